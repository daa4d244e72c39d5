"""`touchplate train SCENE`: train the net of a scene on simulated touches and store it."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from rig.calibration.camera_of import camera_of
from rig.commands.from_session import learn_from, score_net
from rig.commands.loss_curves import save_curves
from rig.commands.output import console, emit, progress, require_folder_of, require_suffix
from rig.commands.score_table import table
from rig.scene import Scene, load, parse_overrides
from rig.scene.sensing import NetEstimator
from rig.training.data import model_path
from rig.training.descend import Sets, check, simulate, train_model
from rig.training.model_score import figures
from rig.training.plan import TrainingPlan, training_plan

if TYPE_CHECKING:
    from models import Model, Net


def train(
    scene: Annotated[str, typer.Argument(help="Name of a shipped scene, or path of a TOML file.")],
    out: Annotated[
        Path | None, typer.Option(help="Model file; results/SCENE/model.h5 by default.")
    ] = None,
    onnx: Annotated[
        Path | None, typer.Option(help="Write the net as an ONNX file too, for other runtimes.")
    ] = None,
    session: Annotated[
        Path | None,
        typer.Option(
            "--from", metavar="FILE", help="Correct the model by known presses of a recording."
        ),
    ] = None,
    curves: Annotated[
        Path | None, typer.Option(help="Draw the losses of the training: a PNG file.")
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="Replace a value: section.key=value.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Train the net of a scene on simulated touches, test it and store it.

    From a recording of known presses the forward model is corrected first: camera and stiffness. A
    net is then trained through that camera, and scored on the presses.
    """
    bench = load(scene, parse_overrides(settings or []))
    other = bench.field_net or bench.image_net or bench.touch_net
    if out:
        require_suffix(out, "model", ".npz" if other else ".h5")
    if curves:
        require_folder_of(curves, "curves", ".png")
    if other:
        _refuse_session(scene, session)
        path = out or model_path(scene).with_suffix(".npz")
        _train_other(bench, path, onnx, curves, as_json)
        return
    learned = learn_from(scene, bench, session) if session else None
    if learned and not isinstance(bench.estimator, NetEstimator):
        emit(learned.sentence, learned.figures, as_json)
        return
    stored = _store(scene, bench, out, onnx, curves)
    said = {"model": str(stored.path), "seconds": stored.seconds} | stored.scores
    if learned and session and (net := stored.net):
        reported = score_net(scene, net, stored.plan, bench, session)
        console().print(f"{learned.sentence}; {reported.sentence}")
        said |= {"presses": learned.figures | {"net": asdict(reported)}}
    emit(table(bench.title, stored.scores), said, as_json)


def _refuse_session(scene: str, session: Path | None) -> None:
    """Refuse presses of a recording for a net that learns from drawn data alone."""
    if session:
        raise ValueError(
            f"--from corrects the bench of a scene by presses, and the net of '{scene}' is trained "
            "on drawn data alone; leave --from out, or name the scene whose bench was pressed"
        )


def _train_other(
    bench: Scene, out: Path, onnx: Path | None, curves: Path | None, as_json: bool
) -> None:
    """Train the net of a scene that has no bench: of fields, images or amplitudes."""
    if bench.field_net:
        from rig.commands.train_dic_net import train_field_net

        train_field_net(bench.field_net, out, onnx, curves, as_json)
    elif bench.image_net:
        from rig.commands.train_dic_net import train_image_net

        train_image_net(bench.image_net, out, onnx, curves, as_json)
    elif bench.touch_net:
        from rig.commands.train_touch_net import train_touch_net

        train_touch_net(bench, bench.touch_net, out, onnx, curves, as_json)


@dataclass(frozen=True, eq=False)
class _Stored:
    """A model that was trained and stored."""

    plan: TrainingPlan
    path: Path
    model: Model
    seconds: float
    scores: dict[str, Any]

    @property
    def net(self) -> Net | None:
        """The net, where the model is one that reads gauges in one step."""
        from models import Trained

        return self.model.net if isinstance(self.model, Trained) else None


def _store(
    scene: str, bench: Scene, out: Path | None, onnx: Path | None, curves: Path | None
) -> _Stored:
    """Train the model of a scene, store it, and write and draw what was asked for beside it."""
    from models import prepare_net_file, save_model, write_model_onnx

    calibration = _calibration(scene, bench)
    plan = training_plan(bench, camera_of(bench, calibration))
    _require_net(plan, onnx, curves)
    path = out or Path(plan.net.model or model_path(scene))
    prepare_net_file(path)
    with progress("influence") as report:
        sets = simulate(plan, report)
    began = time.monotonic()
    trained = _train(plan, sets, path.with_name(f"{path.stem}.part.npz"))
    seconds = time.monotonic() - began
    save_model(path, trained, {"scene": bench.model_dump(mode="json"), "calibration": calibration})
    if onnx:
        write_model_onnx(onnx, trained)
    if curves:
        _draw(curves, trained, check(plan.descent))
    console().print(f"trained in {seconds:.0f} s, stored in {path}")
    return _Stored(plan, path, trained, seconds, figures(trained, sets, plan.touches))


def _require_net(plan: TrainingPlan, onnx: Path | None, curves: Path | None) -> None:
    """Refuse what only a net has, before anything is trained."""
    if isinstance(plan.net, NetEstimator):
        return
    if onnx:
        raise ValueError("a regression is no net and cannot be exported to ONNX; leave --onnx out")
    if curves:
        raise ValueError("a regression has no losses on its way; leave --curves out")


def _calibration(name: str, bench: Scene) -> str:
    """Return the calibration beside a scene as JSON, where a camera reads its gauges."""
    if bench.gauges is None or bench.gauges.subset is None:
        return ""
    from rig.calibration.store import calibration_beside

    return calibration_beside(name).model_dump_json(exclude_none=True)


def _train(plan: TrainingPlan, sets: Sets, part: Path) -> Model:
    """Train with a bar that shows the loss; go on where a run was killed that left `part`."""
    epochs = plan.net.epochs if isinstance(plan.net, NetEstimator) else 1
    with progress("training") as report:
        return train_model(
            plan,
            sets,
            part,
            lambda epoch, loss: report(epoch, epochs, f"loss {loss:.3f} mm"),
        )


def _draw(path: Path, model: Model, apart: int) -> None:
    """Draw both losses over the epochs, as figures 2D, 4A and 5C of the paper."""
    from matplotlib.figure import Figure

    from models import Trained, TrainedTwoStep

    match model:
        case Trained():
            steps = {"": model}
        case TrainedTwoStep():
            steps = {"bend and twist: ": model.shape, "place: ": model.place}
        case _:
            return
    plot: Any = Figure(figsize=(5, 4), layout="constrained")
    axes: Any = plot.subplots()
    for name, trained in steps.items():
        epochs = 1 + apart * np.arange(len(trained.history))
        labels = [f"{name}training", f"{name}validation"]
        axes.loglog(epochs, trained.history, label=labels)
    axes.set(xlabel="epoch", ylabel="loss, mm")
    axes.legend()
    save_curves(path, plot)

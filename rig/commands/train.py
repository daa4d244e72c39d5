"""`touchplate train SCENE`: train the net of a scene on simulated touches and store it."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from rig.calibration.camera_of import camera_of
from rig.commands.from_session import learn_from, score_net
from rig.commands.output import console, emit, progress
from rig.commands.score_table import table
from rig.scene import Scene, load, parse_overrides
from rig.scene.sensing import NetEstimator
from rig.training.data import TrainingSets, model_path, simulate_sets
from rig.training.model_score import figures
from rig.training.plan import TrainingPlan, training_plan

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from models import Checkpoint, Dataset, Loss, Trained

BATCHES_A_CHECK = 100
"""A check on the validation set costs as much as several batches."""


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
        Path | None, typer.Option(help="Draw the losses of training and validation: a PNG file.")
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
    from models import prepare_net_file, save_net

    bench = load(scene, parse_overrides(settings or []))
    learned = learn_from(scene, bench, session) if session else None
    if learned and not isinstance(bench.estimator, NetEstimator):
        emit(learned.sentence, learned.figures, as_json)
        return
    calibration = _calibration(scene, bench)
    plan = training_plan(bench, camera_of(bench, calibration))
    path = out or Path(plan.net.model or model_path(scene))
    prepare_net_file(path)
    with progress("influence") as report:
        sets = simulate_sets(plan, report)
    began = time.monotonic()
    trained = _train(plan, sets, path.with_name(f"{path.stem}.part.npz"))
    seconds = time.monotonic() - began
    about = {"scene": bench.model_dump(mode="json"), "calibration": calibration}
    save_net(path, trained, about)
    if onnx:
        from models import write_onnx

        write_onnx(onnx, trained.net)
    if curves:
        _draw(curves, trained, _check(plan))
    scores = figures(trained.net, sets, plan.touches)
    console().print(f"trained in {seconds:.0f} s, stored in {path}")
    said = {"model": str(path), "seconds": seconds} | scores
    if learned and session:
        reported = score_net(scene, trained.net, plan, bench, session)
        console().print(f"{learned.sentence}; {reported.sentence}")
        said |= {"presses": learned.figures | {"net": asdict(reported)}}
    emit(table(bench.title, scores), said, as_json)


def _calibration(name: str, bench: Scene) -> str:
    """Return the calibration beside a scene as JSON, where a camera reads its gauges."""
    if bench.gauges is None or bench.gauges.subset is None:
        return ""
    from rig.calibration.store import calibration_beside

    return calibration_beside(name).model_dump_json(exclude_none=True)


def _train(plan: TrainingPlan, sets: TrainingSets, part: Path) -> Trained:
    """Train with a bar that shows the loss; go on where a run was killed that left `part`."""
    from models import Checkpoint

    epochs = plan.net.epochs
    with progress("training") as report:
        return descend(
            plan,
            sets,
            plan.net.layers,
            lambda epoch, loss: report(epoch, epochs, f"loss {loss:.3f} mm"),
            Checkpoint(part),
        )


def descend(
    plan: TrainingPlan,
    sets: TrainingSets,
    layers: tuple[int, ...],
    on_epoch: Callable[[int, float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> Trained:
    """Train a net with these layers by the recipe of a scene."""
    from models import NetOptions, Recipe, train_net

    net, touches = plan.net, plan.touches
    rng = np.random.default_rng(net.seed)
    poles = touches if net.target_encoding == "rational" else 0
    return train_net(
        sets.training,
        sets.validation,
        NetOptions(layers, net.activation, net.inputs, poles),
        Recipe(
            net.epochs, net.learning_rate, net.decay, net.outputs, net.lbfgs_steps, _check(plan)
        ),
        rng,
        on_epoch,
        _loss(plan),
        _batches(plan, sets),
        checkpoint,
    )


def _batches(plan: TrainingPlan, sets: TrainingSets) -> Iterator[Dataset] | None:
    """Draw what each step learns from; None where it is all of the training set."""
    from models import mixed_batches, noisy_batches, shuffled_batches

    size, rng = plan.net.batch, np.random.default_rng(plan.net.seed)
    if sets.noise is None:
        return shuffled_batches(sets.training, size, rng) if size else None
    pool, images = sets.noise.pool, sets.noise.images
    size = min(size or len(pool), len(pool))
    stream = noisy_batches(shuffled_batches(pool, size, rng), sets.noise.root, rng)
    if images is None:
        return stream
    few = max(round(size * plan.training.rendered_fraction), 1)
    return mixed_batches(stream, shuffled_batches(images, few, rng))


def _loss(plan: TrainingPlan) -> Loss:
    """Return equation 2 or 3 of the paper, for what the net of a scene estimates."""
    from models import distance_loss, magnitude_loss, permutation_invariant_loss

    weight = plan.net.magnitude_weight
    if plan.net.target_encoding == "rational":
        return permutation_invariant_loss(plan.touches, weight)
    return magnitude_loss(plan.touches, weight) if plan.magnitudes else distance_loss(plan.touches)


def _check(plan: TrainingPlan) -> int:
    """Return the epochs between two checks on the validation set."""
    return BATCHES_A_CHECK if plan.net.batch else 1


def _draw(path: Path, trained: Trained, check: int) -> None:
    """Draw both losses over the epochs, as figures 2D and 4A of the paper."""
    from matplotlib.figure import Figure

    plot: Any = Figure(figsize=(5, 4), layout="constrained")
    axes: Any = plot.subplots()
    epochs = 1 + check * np.arange(len(trained.history))
    axes.loglog(epochs, trained.history, label=["training", "validation"])
    axes.set(xlabel="epoch", ylabel="loss, mm")
    axes.legend()
    try:
        plot.savefig(path, dpi=120)
    except (OSError, ValueError) as error:
        raise OSError(
            f"curves {path} cannot be drawn ({error}); give a PNG file in a folder that exists"
        ) from error

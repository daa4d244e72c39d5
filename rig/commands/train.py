"""`touchplate train SCENE`: train the net of a scene on simulated touches and store it."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from rig.calibration.camera_of import camera_of
from rig.commands.from_session import judge_net, learn_from
from rig.commands.output import console, emit, progress
from rig.commands.score_table import table
from rig.scene import Scene, load, parse_overrides
from rig.scene.sensing import NetEstimator
from rig.training.data import Sets, model_path, simulate
from rig.training.model_score import figures
from rig.training.plan import Lesson, lesson

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from models.data.dataset import Dataset
    from models.nets.checkpoint import Checkpoint
    from models.nets.loss import Loss
    from models.nets.train import Trained

BATCHES_A_CHECK = 100
"""Looking at the validation set costs as much as several batches."""


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
    net is then trained through that camera, and told the presses.
    """
    from models.nets import store

    bench = load(scene, parse_overrides(settings or []))
    learned = learn_from(scene, bench, session) if session else None
    if learned and not isinstance(bench.estimator, NetEstimator):
        emit(learned.sentence, learned.figures, as_json)
        return
    calibration = _calibration(scene, bench)
    taught = lesson(bench, camera_of(bench, calibration))
    path = out or Path(taught.net.model or model_path(scene))
    store.prepare(path)
    with progress("influence") as report:
        sets = simulate(taught, report)
    began = time.monotonic()
    trained = _train(taught, sets, path.with_name(f"{path.stem}.part.npz"))
    seconds = time.monotonic() - began
    about = {"scene": bench.model_dump(mode="json"), "calibration": calibration}
    store.save(path, trained, about)
    if onnx:
        from models.nets.onnx import write_onnx

        write_onnx(onnx, trained.net)
    if curves:
        _draw(curves, trained, _check(taught))
    scores = figures(trained.net, sets, taught.touches)
    console().print(f"trained in {seconds:.0f} s, stored in {path}")
    said = {"model": str(path), "seconds": seconds} | scores
    if learned and session:
        told = judge_net(scene, trained.net, taught, bench, session)
        console().print(f"{learned.sentence}; {told.sentence}")
        said |= {"presses": learned.figures | {"net": asdict(told)}}
    emit(table(bench.title, scores), said, as_json)


def _calibration(name: str, bench: Scene) -> str:
    """Return the calibration beside a scene as JSON, where a camera reads its gauges."""
    if bench.gauges is None or bench.gauges.subset is None:
        return ""
    from rig.calibration.store import beside, read

    return read(beside(name)).model_dump_json(exclude_none=True)


def _train(taught: Lesson, sets: Sets, part: Path) -> Trained:
    """Train with a bar that shows the loss; go on where a run was killed that left `part`."""
    from models.nets.checkpoint import Checkpoint

    epochs = taught.net.epochs
    with progress("training") as report:
        return descend(
            taught,
            sets,
            taught.net.layers,
            lambda epoch, loss: report(epoch, epochs, f"loss {loss:.3f} mm"),
            Checkpoint(part),
        )


def descend(
    taught: Lesson,
    sets: Sets,
    layers: tuple[int, ...],
    on_epoch: Callable[[int, float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> Trained:
    """Train a net with these layers by the recipe of a scene."""
    from models.nets.net import NetOptions
    from models.nets.recipe import Recipe
    from models.nets.train import train

    net, touches = taught.net, taught.touches
    rng = np.random.default_rng(net.seed)
    poles = touches if net.told == "poles" else 0
    return train(
        sets.training,
        sets.validation,
        NetOptions(layers, net.activation, net.inputs, poles),
        Recipe(net.epochs, net.learning_rate, net.decay, net.outputs, net.finish, _check(taught)),
        rng,
        on_epoch,
        _loss(taught),
        _batches(taught, sets),
        checkpoint,
    )


def _batches(taught: Lesson, sets: Sets) -> Iterator[Dataset] | None:
    """Draw what each step learns from; None where it is all of the training set."""
    from models.nets.batches import mixed, noisy, shuffled

    size, rng = taught.net.batch, np.random.default_rng(taught.net.seed)
    if sets.noise is None:
        return shuffled(sets.training, size, rng) if size else None
    pool, pictures = sets.noise.pool, sets.noise.pictures
    size = min(size or len(pool), len(pool))
    stream = noisy(shuffled(pool, size, rng), sets.noise.root, rng)
    if pictures is None:
        return stream
    few = max(round(size * taught.training.share), 1)
    return mixed(stream, shuffled(pictures, few, rng))


def _loss(taught: Lesson) -> Loss:
    """Return equation 2 or 3 of the paper, for what the net of a scene tells."""
    from models.nets.loss import distance, magnitudes_too
    from models.nets.set_encoding import unordered

    weight = taught.net.magnitude_weight
    if taught.net.told == "poles":
        return unordered(taught.touches, weight)
    return magnitudes_too(taught.touches, weight) if taught.magnitudes else distance(taught.touches)


def _check(taught: Lesson) -> int:
    """Return the epochs between two looks at the validation set."""
    return BATCHES_A_CHECK if taught.net.batch else 1


def _draw(path: Path, trained: Trained, check: int) -> None:
    """Draw both losses over the epochs, as figures 2D and 4A of the paper."""
    from matplotlib.figure import Figure

    picture = Figure(figsize=(5, 4), layout="constrained")
    axes = picture.subplots()
    epochs = 1 + check * np.arange(len(trained.history))
    axes.loglog(epochs, trained.history, label=["training", "validation"])
    axes.set(xlabel="epoch", ylabel="loss, mm")
    axes.legend()
    try:
        picture.savefig(path, dpi=120)
    except (OSError, ValueError) as error:
        raise OSError(
            f"curves {path} cannot be drawn ({error}); give a PNG file in a folder that exists"
        ) from error

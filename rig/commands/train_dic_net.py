"""Nets of displacement, of `touchplate train`: trained on fields or images, stored, exported."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rig.commands.loss_curves import draw_steps
from rig.commands.output import emit, progress
from rig.scene.field_net import FieldNetSection
from rig.scene.image_net import ImageNetSection

if TYPE_CHECKING:
    from models import Checkpoint

EVERY = 50  # steps between two checkpoints


def train_field_net(
    section: FieldNetSection, path: Path, onnx: Path | None, curves: Path | None, as_json: bool
) -> None:
    """Train the field net of a scene, going on where a run was killed, and store it.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    import models

    recipe = models.FieldNetRecipe(**section.model_dump())
    with _kept(path, section.steps + section.rendered) as (checkpoint, on_step):
        trained = models.train_field_net(recipe, checkpoint, on_step, time.process_time)
        models.save_field_net(path, trained.net)
    if onnx:
        models.write_field_onnx(onnx, trained.net)
    if curves:
        draw_steps(curves, {"training of the field net": trained.history})
    _emit(section, trained.history, trained.seconds, path, as_json)


def train_image_net(
    section: ImageNetSection, path: Path, onnx: Path | None, curves: Path | None, as_json: bool
) -> None:
    """Train the image net of a scene, going on where a run was killed, and store it.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    import models

    recipe = models.ImageNetRecipe(**section.model_dump())
    with _kept(path, section.steps) as (checkpoint, on_step):
        trained = models.train_image_net(recipe, checkpoint, on_step, time.process_time)
        models.save_image_net(path, trained.net)
    if onnx:
        models.write_image_onnx(onnx, trained.net)
    if curves:
        draw_steps(curves, {"training of the image net": trained.history})
    _emit(section, trained.history, trained.seconds, path, as_json)


@contextmanager
def _kept(path: Path, steps: int) -> Generator[tuple[Checkpoint, Callable[[int, float], None]]]:
    """Give the checkpoint of a net that is to be stored, cleared at its end, and a progress."""
    from models import Checkpoint, prepare_net_file

    prepare_net_file(path)
    checkpoint = Checkpoint(path.with_name(f"{path.stem}.part.npz"), EVERY)
    with progress("training") as report:
        yield checkpoint, lambda step, loss: report(step, steps, f"loss {loss:.3f}")
    checkpoint.clear()


def _emit(
    section: FieldNetSection | ImageNetSection,
    history: NDArray[np.float64],
    seconds: float,
    path: Path,
    as_json: bool,
) -> None:
    """Say how a training went."""
    loss = float(history[-max(section.steps // 10, 1) :].mean())
    figures = {
        "model": str(path),
        "steps": section.steps,
        "seed": section.seed,
        "cpu_seconds": seconds,
        "loss": loss,
    }
    emit(f"trained in {seconds:.0f} CPU s, loss {loss:.3f}, stored in {path}", figures, as_json)

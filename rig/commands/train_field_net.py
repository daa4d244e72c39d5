"""The field net of `touchplate train dic-net`: trained on drawn fields, stored and exported."""

from __future__ import annotations

import time
from pathlib import Path

from rig.commands.output import emit, progress
from rig.scene.field_net import FieldNetSection

EVERY = 50  # steps between two checkpoints


def train_field_net(section: FieldNetSection, path: Path, onnx: Path | None, as_json: bool) -> None:
    """Train the field net of a scene, going on where a run was killed, and store it.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    import models

    recipe = models.FieldNetRecipe(
        steps=section.steps,
        seed=section.seed,
        pairs=section.pairs,
        side=section.side,
        learning_rate=section.learning_rate,
        horizon=section.horizon,
        plates=section.plates,
    )
    models.prepare_net_file(path)
    checkpoint = models.Checkpoint(path.with_name(f"{path.stem}.part.npz"), EVERY)
    with progress("training") as report:
        trained = models.train_field_net(
            recipe,
            checkpoint,
            lambda step, loss: report(step, section.steps, f"loss {loss:.3f}"),
            time.process_time,
        )
    models.save_field_net(path, trained.net)
    checkpoint.clear()
    if onnx:
        models.write_field_onnx(onnx, trained.net)
    last = trained.history[-max(section.steps // 10, 1) :]
    figures = {
        "model": str(path),
        "steps": section.steps,
        "seed": section.seed,
        "cpu_seconds": trained.seconds,
        "loss": float(last.mean()),
    }
    text = f"trained in {trained.seconds:.0f} CPU s, loss {last.mean():.3f}, stored in {path}"
    emit(text, figures, as_json)

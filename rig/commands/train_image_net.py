"""The image net of `touchplate train image-net`: trained on rendered pairs, stored and exported."""

from __future__ import annotations

import time
from pathlib import Path

from rig.commands.output import emit, progress
from rig.scene.image_net import ImageNetSection

EVERY = 50  # steps between two checkpoints


def train_image_net(section: ImageNetSection, path: Path, onnx: Path | None, as_json: bool) -> None:
    """Train the image net of a scene, going on where a run was killed, and store it.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    import models

    recipe = models.ImageNetRecipe(
        steps=section.steps,
        seed=section.seed,
        pairs=section.pairs,
        side=section.side,
        learning_rate=section.learning_rate,
        horizon=section.horizon,
        patterns=section.patterns,
        plates=section.plates,
    )
    models.prepare_net_file(path)
    checkpoint = models.Checkpoint(path.with_name(f"{path.stem}.part.npz"), EVERY)
    with progress("training") as report:
        trained = models.train_image_net(
            recipe,
            checkpoint,
            lambda step, loss: report(step, section.steps, f"loss {loss:.3f}"),
            time.process_time,
        )
    models.save_image_net(path, trained.net)
    checkpoint.clear()
    if onnx:
        models.write_image_onnx(onnx, trained.net)
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

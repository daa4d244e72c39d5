"""The touch net of `touchplate train touch-net`: trained on drawn touches, stored and exported."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

from rig.commands.loss_curves import draw_steps
from rig.commands.output import emit, progress
from rig.scene import Scene
from rig.scene.touch_net import TouchNetSection
from rig.training.touch_nets import described_bench, touch_net_recipe, touch_range

EVERY = 500  # steps between two checkpoints


def train_touch_net(
    scene: Scene,
    section: TouchNetSection,
    path: Path,
    onnx: Path | None,
    curves: Path | None,
    as_json: bool,
) -> None:
    """Train the touch net of a scene, going on where a run was killed, and store it.

    Raises
    ------
    ValueError
        The scene lacks what the net is trained on.
    OSError
        A file cannot be written.
    """
    import models

    touches, recipe = touch_range(scene, section), touch_net_recipe(section)
    models.prepare_net_file(path)
    checkpoint = models.Checkpoint(path.with_name(f"{path.stem}.part.npz"), EVERY)
    total = recipe.steps + recipe.head_steps
    with progress("training") as report:
        trained = models.train_touch_net(
            described_bench(scene),
            touches,
            recipe,
            checkpoint,
            lambda step, loss: report(step, total, f"loss {loss:.3f}"),
            time.process_time,
        )
    about = trained.net.about | {"scene": scene.model_dump(mode="json")}
    net = replace(trained.net, about=about)
    models.save_touch_net(path, net)
    checkpoint.clear()
    if onnx:
        models.write_touch_onnx(onnx, net)
    proposing, looking = trained.history[: recipe.steps], trained.history[recipe.steps :]
    if curves:
        draw_steps(curves, {"proposals": proposing, "looking at how they fit": looking})
    losses = [float(part[-max(len(part) // 10, 1) :].mean()) for part in (proposing, looking)]
    figures = {
        "model": str(path),
        "steps": recipe.steps,
        "head_steps": recipe.head_steps,
        "seed": recipe.seed,
        "cpu_seconds": trained.seconds,
        "loss": losses[0],
        "head_loss": losses[1],
    }
    text = (
        f"trained in {trained.seconds:.0f} CPU s, loss {losses[0]:.3f} and {losses[1]:.3f}, stored"
        f" in {path}"
    )
    emit(text, figures, as_json)

"""The paper's figures of the plate itself: 2A with its gauges, and 3C, the plate on the bench."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

import rig
from models import grid_places, midpoint_places
from rig.report.figure import Figure
from rig.studies.paper import plots
from rig.studies.paper.bench import FRAMES, PRESSES, BenchImages
from rig.studies.paper.rows import seeds
from rig.studies.paper.trainings import train_kept
from rig.studies.study import line, part
from rig.system.arrays import F64

SEEDS = 3


def layout(folder: Path) -> Iterator[Figure]:
    """Gauges by both readings, and the touches of training and validation (2A, 2B)."""
    title = "Figures 2A and 2B: plate, gauges and touches"
    scene = rig.load("paper-one")
    size, training = part(scene.plate).size, part(scene.training)
    learnt = grid_places(size, training.spacing, training.margin)
    watched = midpoint_places(size, training.spacing, training.margin, training.validation_side)
    drawn, axes = plots.canvas(2, width=4.4, height=4.2)
    readings = {
        "reading B: 72 gauges on the clamped edge": _gauges("edges"),
        "reading A: 72 gauges on a square 5 mm inside": _gauges("inside"),
    }
    for panel, (name, gauges) in zip(axes[0], readings.items(), strict=True):
        panel.plot(*gauges.T, "s", color="0.4", ms=5, label=f"{len(gauges)} gauges")
        panel.plot(*learnt.T, ".", color="tab:red", ms=4, label=f"{len(learnt)} learnt")
        panel.plot(*watched.T, "+", color="tab:blue", ms=4, label=f"{len(watched)} watched")
        panel.set(title=name, xlabel="x, mm", ylabel="y, mm", aspect="equal")
        panel.legend(fontsize="x-small", loc="upper right", framealpha=0.95)
    yield plots.keep(drawn, folder, "paper-2a.png", title, "both readings of the paper")
    rows, columns = len(learnt), 3 * 72
    for what, value, paper in (
        ("rows of the training input", rows, 289),
        ("columns of the training input", columns, 216),
        ("places watched", len(watched), 196),
    ):
        yield from line(title, what, here=(value, ""), paper=(paper, ""))


def _gauges(placement: str) -> F64:
    scene = rig.load("paper-one", {"gauges.placement": placement})
    return part(scene.gauges).build(part(scene.plate))


def bench(folder: Path) -> Iterator[Figure]:
    """Presses on the twin of the paper's bench, as they are and as they are predicted (3C)."""
    title = "Figure 3C: validation on the plate, strain by DIC"
    kept = [train_kept("paper-bench", {}, seed) for seed in range(SEEDS)]
    images = BenchImages(rig.load("paper-bench"))
    nets = [images.by_net(each.net, 0) for each in kept]
    side = part(rig.load("paper-bench").plate).size[0]
    solved = images.by_solver()
    drawn, axes = plots.canvas(2, width=4.6, height=4.4)
    errors = [images.errors(found) for found in nets]
    middle = int(np.argsort([each.mean() for each in errors])[SEEDS // 2])
    solver = "solver on the whole pattern"
    for panel, name, found in zip(
        axes[0], ("the paper's net", solver), (nets[middle], solved[solver]), strict=True
    ):
        plots.places(panel, images.places, images.found(found), name)
        panel.set(xlim=(0, side), ylim=(0, side))
    text = f"{PRESSES} presses of 0.2 N, {FRAMES} images averaged"
    yield plots.keep(drawn, folder, "paper-3c.png", title, text)
    works = "works, slightly less accurate"
    yield from seeds(title, "net: loss", [float(e.mean()) for e in errors], "mm", works)
    over = [100 * float(each.mean()) / side for each in errors]
    yield from seeds(title, "net: loss over the side", over, "%")
    for name, found in solved.items():
        error = images.errors(found)
        shown = {"largest": (float(error.max()), "mm")}
        yield from line(title, f"{name}: loss", here=(float(error.mean()), "mm", None, 1), **shown)

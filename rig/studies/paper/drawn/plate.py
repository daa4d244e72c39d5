"""The paper's figures of the plate itself: 2A with its gauges and touches."""

from collections.abc import Iterator
from pathlib import Path

import rig
from models import grid_places, midpoint_places
from rig.report.figure import Figure
from rig.studies.paper.drawn import plots
from rig.studies.study import line, part
from rig.system.arrays import F64


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

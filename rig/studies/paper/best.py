"""The whole paper by the best recipes, each system once, and what it costs: one command.

Usage: ``python -m rig.studies.paper.best``. A training that is kept is read and counts with the
time that it took.
"""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from models import matched_error
from rig.report.figure import Bar, Figure, at_most
from rig.studies.paper.drawn.bent import loss_at_load
from rig.studies.paper.drawn.magnitudes import scored
from rig.studies.paper.drawn.size import FINEST_BEST
from rig.studies.paper.drawn.trainings import KeptTraining, Settings, train_kept
from rig.studies.study import Cell, line, run_drawn
from rig.training.bases import RATIOS

TITLE = "The whole paper by the best recipes"


class System(NamedTuple):
    """One system of the paper: its name, the scene, what is set, the paper's loss, the bar."""

    name: str
    scene: str
    settings: Settings
    paper: str
    bar: Bar


SYSTEMS = (
    System("one touch", "paper-one-best", {}, "0.38 mm", at_most(0.03)),
    System("one touch, spacing 1/1", FINEST_BEST, {}, "0.06 mm", at_most(0.01)),
    System("two touches", "paper-two-best", {}, "", at_most(0.43)),
    System("three touches", "paper-three-best", {}, "0.43 mm", at_most(0.43)),
    System("two magnitudes", "paper-two-magnitudes-best", {}, "< 0.5 mm", at_most(0.5)),
    System("deformable, worst load", "paper-deformable-best", {}, "0.48 mm", at_most(0.1)),
)


def best(folder: Path) -> Iterator[Figure]:
    """Train each system once; add up the CPU time of trainings, simulations and tests."""
    began, spent, kept_before = time.process_time(), 0.0, 0.0
    for system in SYSTEMS:
        start = time.process_time()
        kept = train_kept(system.scene, system.settings, 0)
        taken = time.process_time() - start
        kept_before += max(kept.cpu - taken, 0.0)
        shown: dict[str, Cell] = {"training": (kept.cpu, "CPU s")}
        if system.paper:
            shown["paper"] = system.paper
        loss = (_loss(kept), "mm", system.bar, 1)
        yield from line(TITLE, system.name, here=loss, **shown)
        spent = time.process_time() - began + kept_before
    yield from line(TITLE, "all of it", **{"CPU time": (spent, "CPU s", at_most(1200.0), 1)})


def _loss(kept: KeptTraining) -> float:
    """Mean error of the test, mm; on bases that of the worst load."""
    if kept.plan.training.bases:
        return max(loss_at_load(kept, ratio) for ratio in RATIOS)
    if kept.plan.magnitudes:
        return scored(kept)[0]
    touches = kept.plan.touches
    true, found = (each[:, : 2 * touches].reshape(-1, touches, 2) for each in kept.test())
    return float(np.mean(matched_error(true, found)[0]))


if __name__ == "__main__":
    run_drawn({"best": best}, __doc__)

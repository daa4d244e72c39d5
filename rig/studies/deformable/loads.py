"""Touches of several loads on a base that is bent and twisted, from the strain of gauges.

The plate, gauges and bases of the paper's deformable surface (scene paper-deformable-best). Truth
is the whole nonlinear shell under the touch on 28 × 28 elements; the solver reads the change of
strain with the tangent of the base, which is known, on 20 × 20. Loads are those of the paper's
figure 5D, in parts of Δ0 = 1 N: what the tangent leaves out grows with them. Without noise.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import fe
from rig.report.figure import Figure, at_most
from rig.scene import load
from rig.studies.deformable.tangent import Tangent
from rig.studies.deformable.truth import SIDE
from rig.studies.study import line, part, run
from rig.training.bases import RATIOS
from rig.training.plan import training_plan

TABLE = "A touch on a base, load by load"
CASE = "solver on a bent and twisted base, load ratios 0.5 to 1.5"
BASES, TOUCHES, ELEMENTS, SEED = 12, 4, 20, 41
UNIT = 1.0  # N, the paper's Δ0
PAPER = at_most(0.48)


def loads() -> Iterator[Figure]:
    """Solve for touches of each load on bases that are drawn as for the paper's nets."""
    plan = training_plan(load("paper-deformable-best"))
    plate, gauges = plan.plate.build(), plan.gauges.build(plan.plate)
    drawn, rng = part(plan.training.bases), np.random.default_rng(SEED)
    here, there = (fe.Shell(plate, fe.Mesh(plate.size, (side, side))) for side in (ELEMENTS, SIDE))
    off = np.empty((BASES, TOUCHES, len(RATIOS)))
    margin, size = plan.training.margin, np.array(plate.size)
    for errors in off:
        base = fe.Base(float(rng.uniform(*drawn.bend)), float(rng.uniform(*drawn.twist)))
        solver = Tangent(fe.shell_influence(here.at(base), gauges), plate.size)
        truth = there.at(base)
        before = truth.strain(gauges)
        for row in errors:
            place = rng.uniform(margin, size - margin)
            for number, ratio in enumerate(RATIOS):
                pressed = truth.touch([fe.Touch(float(place[0]), float(place[1]), ratio * UNIT)])
                found = solver.fit((pressed.strain(gauges) - before).ravel())
                row[number] = float(np.hypot(*(found[:2] - place)))
    for number, ratio in enumerate(RATIOS):
        at = off[:, :, number]
        said = f"solver on a bent and twisted base, {ratio:g} Δ0"
        largest = {"largest": (float(at.max()), "mm", None, at.size)}
        yield from line(TABLE, said, error=(float(at.mean()), "mm", None, at.size), **largest)
    largest = {"largest": (float(off.max()), "mm", None, off.size)}
    yield from line(TABLE, CASE, error=(float(off.mean()), "mm", PAPER, off.size), **largest)


if __name__ == "__main__":
    run({"loads": loads}, __doc__)

"""What the reduced plate misses of large touches, beside what is stated of it.

Parts: few, some and many (2, 10 and 34 scenes a cell: one or two touches, on a plate with four or
two clamped edges). Each is rendered from the geometrically exact shell and read three times. What
is missed is in units of what stretching moves over a side of the plate, over all that is measured
(`models.forward.large`); `alike` says by how much more than an even error of that size it moves
touches, in variance (`models.inverse.solver`). The scenes are others than those of
`rig.studies.touches.large`.
"""

import time
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

import fe
import models
from models.inverse.solver import ALIKE
from rig.live.chain import Chain
from rig.live.frame_estimate import estimate_frame
from rig.report.figure import Bar, Figure
from rig.studies.study import line, run
from rig.studies.touches.large import COUNTS, ELEMENTS, PIXELS, THICKNESS, after, drawn, prepared
from rig.studies.touches.pattern import EDGES, SENSOR, Bench, stand
from rig.system.arrays import F64
from rig.system.timing import Stopwatch

TABLE, WITHIN_TWICE = "What the reduced plate misses", Bar(0.5, 2.0)
SEED, READINGS = 100, 3


class Misfit(NamedTuple):
    """Squares of a scene, the noise taken off: all that is missed, and what it moves touches by.

    Each beside that which an even error of the stated size would be.
    """

    all: float
    stated: float
    moved: float
    moved_evenly: float


def missed(scenes: int) -> Iterator[Figure]:
    """Compare so many scenes a cell with what is stated."""
    every: list[Misfit] = []
    for edges, clamped in EDGES.items():
        bench = stand(THICKNESS, PIXELS, clamped)
        chain = prepared(bench, max(COUNTS) + 1)
        for count, name in COUNTS.items():
            found = list(misfits(bench, chain, count, scenes))
            every += found
            yield from _summed(f"{edges} clamped edges, {name}", found, ALIKE * count**2)
    yield from _summed("reduced plate", every, None)


def misfits(bench: Bench, chain: Chain, count: int, scenes: int) -> Iterator[Misfit]:
    """Read so many scenes of a cell at the touches that are there."""
    mesh, rng = fe.grid(bench.plate, ELEMENTS), np.random.default_rng(SEED + count)
    for _ in range(scenes):
        touches = drawn(rng, count)
        truth = tuple(fe.Touch(*touch) for touch in touches.tolist())
        moved = fe.solve(bench.plate, truth, mesh=mesh).displacement(bench.warper.points)
        light = bench.light(moved)
        readings = [read(chain, SENSOR.capture(light, rng), touches) for _ in range(READINGS)]
        yield misfit(readings, touches)


Reading = tuple[F64, models.Forward]


def read(chain: Chain, image: F64, touches: F64) -> Reading:
    """Measure a frame, with what its forward model is."""
    found = estimate_frame(chain, image, after(chain, touches), Stopwatch(time.monotonic))
    if found.measured is None:
        raise ValueError(f"the frame was not measured: {found.estimate.result}; draw others")
    _, estimator = chain.masked_models.for_mask(found.hidden)
    return found.measured, estimator.candidates.forward


def misfit(readings: list[Reading], touches: F64) -> Misfit:
    """Compare the mean of some readings with a forward model at the touches that are there."""
    forward, noise = readings[0][1], 1.0 / len(readings)
    seen, jacobian = forward.read(touches)
    off = np.mean([measured for measured, _ in readings], axis=0) - seen
    along = np.linalg.qr(jacobian.T)[0].T @ off
    stated = forward.own_error(touches) ** 2
    return Misfit(
        all=float(off @ off) - noise * len(off),
        stated=stated,
        moved=float(along @ along) - noise * len(along),
        moved_evenly=stated * len(along) / len(off),
    )


def _summed(case: str, found: list[Misfit], alike: float | None) -> Iterator[Figure]:
    everything, stated, moved, evenly = np.sum(found, axis=0)
    yield from line(
        TABLE,
        case,
        **{
            "its own estimate over the error": (
                float(np.sqrt(stated / everything)),
                "",
                WITHIN_TWICE,
                len(found),
            ),
            "alike": (float(moved / evenly), "", None, len(found)),
            "alike, stated": alike,
        },
    )


PARTS = {"few": partial(missed, 2), "some": partial(missed, 10), "many": partial(missed, 34)}

if __name__ == "__main__":
    run(PARTS, __doc__)

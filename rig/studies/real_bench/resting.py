"""Touches at rest on a bench that nine presses have shown: what a second of frames makes of them.

Parts: few (3 touches on each of three seeds), second (8). The bench is the one of `as_it_is` on
which all is wrong. Every touch is held for a second at 30 frames a second, and the plate is alone
for a third of one after it. Scored are the last frame of each alone, and the touch as it is shown
then, which is the posterior of all its frames. What is not known of the bench is the same in each
of them: σ of what is shown has to hold it. Truth is the whole plate of von Kármán, as there.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

import fe
import rig
from rig.calibration.store import Calibration
from rig.live.bench import build_bench
from rig.live.loop import Loop
from rig.live.snapshot import Mark
from rig.report.figure import Figure
from rig.studies.real_bench.as_it_is import INSIDE, SEEDS, identified, kept
from rig.studies.real_bench.departure import ALL, SAID
from rig.studies.real_bench.frame_source import FrameSource
from rig.studies.real_bench.session import MARGIN, REFERENCES, write_presses, write_scene
from rig.studies.real_bench.truth import Truth
from rig.studies.study import line, run
from rig.system.arrays import F64
from rig.system.frame import Frame

TABLE = "Touches at rest on the bench as it is"
HELD, ALONE = 30, 10  # frames
_INTERVAL = 1.0 / 30.0  # s


class RestingSource(FrameSource):
    """Frames of touches that are held one after the other.

    Attributes
    ----------
    last : dict of int to (3,) float64, mm, mm, N
        What touches the plate in the last frame of each touch, by its number.
    """

    def __init__(self, truth: Truth, count: int):
        self.last = dict[int, F64]()
        super().__init__(self._all(truth, count), "touches that are held")

    def _all(self, truth: Truth, count: int) -> Iterator[Frame]:
        for number in range(REFERENCES):
            yield Frame(number, number * _INTERVAL, truth.reference(number))
        points, first = truth.later.points, REFERENCES
        alone = truth.displacement(points, ())
        for touch in _touches(truth.seed, count):
            pressed = truth.displacement(points, (touch,))
            self.last[first + HELD - 1] = np.array([touch.x, touch.y, touch.force])
            for k in range(HELD + ALONE):
                image = truth.image(pressed if k < HELD else alone, 1, first + k)
                yield Frame(first + k, (first + k) * _INTERVAL, image)
            first += HELD + ALONE


def _touches(seed: int, count: int) -> Iterator[fe.Touch]:
    rng, sides = np.random.default_rng((seed, 8)), np.array(SAID.size)
    for _ in range(count):
        x, y = rng.uniform(MARGIN, sides - MARGIN).tolist()
        yield fe.Touch(x, y, float(rng.uniform(0.5, 4.0)))


def resting(count: int) -> Iterator[Figure]:
    """Score touches that are held for a second."""
    alone, shown = list[F64](), list[F64]()
    for seed in SEEDS:
        one, all_of_them = _seen(seed, count)
        alone += one
        shown += all_of_them
    yield from _scored("the last frame alone", alone)
    yield from _scored("all frames of a second", shown)


def _seen(seed: int, count: int) -> tuple[list[F64], list[F64]]:
    """Errors and σ of x, y, F of touches, (2, 3) each: of their last frame alone, and as shown."""
    truth = Truth(ALL, seed)
    with tempfile.TemporaryDirectory() as place:
        path = write_scene(Path(place), Path(place) / "touches")
        listed = write_presses(truth, Path(place) / "presses", 9)
        known: Calibration = kept(identified(path, listed, listed.with_suffix("")), Path(place))
        scene = rig.load(path)
    source = RestingSource(truth, count)
    alone, shown = list[F64](), list[F64]()
    for one in Loop(
        build_bench(scene, lambda done, total: None, known), source, lambda: source.now
    ):
        touch = source.last.get(one.sequence)
        if touch is None or one.estimate is None or not len(one.touches):
            continue
        estimate = one.estimate
        mark = one.touches[int(np.argmin([_away(mark, touch) for mark in one.touches]))]
        best = int(np.argmin(np.hypot(*(estimate.xy - touch[:2]).T)))
        found = np.append(estimate.xy[best], estimate.force[best])
        sigma = np.sqrt(np.diag(estimate.touch_covariance(best)))
        alone.append(np.array([found - touch, sigma]))
        error = np.array([mark.x, mark.y, mark.force]) - touch
        shown.append(np.array([error, [mark.sigma_x, mark.sigma_y, mark.sigma_force]]))
    return alone, shown


def _away(mark: Mark, touch: F64) -> float:
    return float(np.hypot(mark.x - touch[0], mark.y - touch[1]))


def _scored(case: str, seen: list[F64]) -> Iterator[Figure]:
    """Figures of errors and σ of x, y, F of touches, (2, 3) each."""
    both = np.asarray(seen, dtype=np.float64)
    errors, sigma = both[:, 0], both[:, 1]
    within, place = np.abs(errors / sigma), np.hypot(errors[:, 0], errors[:, 1])
    one, two = (100.0 * float(np.mean(within < limit)) for limit in (1.0, 2.0))
    yield from line(
        TABLE,
        case,
        **{
            "place, median": (float(np.median(place)), "mm", None, len(place)),
            "force": (float(np.median(np.abs(errors[:, 2]))), "N", None, len(place)),
            "σ of x": (float(np.median(sigma[:, 0])), "mm", None, len(place)),
            "inside 1 σ": (one, "%", INSIDE[0], within.size),
            "inside 2 σ": (two, "%", INSIDE[1], within.size),
        },
    )


PARTS = {"few": partial(resting, 3), "second": partial(resting, 8)}

if __name__ == "__main__":
    run(PARTS, __doc__)

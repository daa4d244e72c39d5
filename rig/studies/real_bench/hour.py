"""An hour on a bench that changes: a plate that warms, creeps and a camera that drifts.

Parts: few (20 touches), hour (60, one a minute). Nine presses show the bench once, before it begins
to change: all that `as_it_is` has wrong together, and 5 % of every touch that ended stay in the
plate. Then the temperature of the plate in its frame goes up and down by 1 K in ten minutes, half a
kelvin to either side of that of the presses (0.85 K above it this plate buckles), and the camera
drifts by 0.05 px a minute. Before each touch the plate is alone for most of a minute; it is held
for some frames, of which the last one counts, and a frame of the plate alone follows it. Truth is
the whole plate of von Kármán, as there.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

import fe
import rig
from rig.live.bench import build_bench
from rig.live.loop import Loop
from rig.report.figure import Figure, at_most
from rig.studies.real_bench.as_it_is import cells, identified, kept
from rig.studies.real_bench.departure import ALL, SAID, RealBench
from rig.studies.real_bench.frame_source import FrameSource
from rig.studies.real_bench.score import compared
from rig.studies.real_bench.session import REFERENCES, Touched, write_presses, write_scene
from rig.studies.real_bench.truth import Truth
from rig.studies.study import line, run
from rig.system.arrays import F64, Grey
from rig.system.frame import Frame

TABLE = "The bench as it is, for an hour"
SEED = 3
BARS = at_most(0.4), None, at_most(2.0)
HOUR_CASE = "an hour of warming, creep and drift"
HOUR = 60  # minutes, of which the bars speak
HELD = 22  # frames of a touch: some show the bench, and some pass until it is taken over
# Images of the plate alone before it, over most of the minute: each stands for some seconds of
# frames, of which the state of rest is the mean.
_REST = 6
_MINUTE, _INTERVAL = 60.0, 1.0 / 30.0  # s
_PERIOD = 20  # minutes, of which the plate warms by 1 K in one half and cools in the other
_KELVIN = SAID.young * SAID.thickness * 7e-5 / (1.0 - SAID.poisson)  # N/mm, PVC
_DRIFT = 0.05 * 500.0 / 1850.0  # mm a minute, 0.05 px
_MARGIN = 25.0  # mm


AT_FIRST = replace(ALL, leftover=0.05)


def bench_after(minute: int) -> RealBench:
    """Return the bench so many minutes after it was calibrated."""
    phase = 4.0 * (minute / _PERIOD % 1.0)  # quarters of a period
    kelvin = 0.5 * (phase if phase < 1.0 else 2.0 - phase if phase < 3.0 else phase - 4.0)
    xx, yy, xy = ALL.plate.tension
    tension = (xx - _KELVIN * kelvin, yy - _KELVIN * kelvin, xy)
    moved = (0.0, 0.0, 0.0, _DRIFT * minute, 0.0, 0.0, 0.0, 0.0, 0.0)
    return replace(AT_FIRST, plate=replace(ALL.plate, tension=tension), moved=moved)


@dataclass(frozen=True)
class Minute:
    """Frames of the plate alone, of a touch and of the plate again, and what touched."""

    number: int
    touch: F64
    before: tuple[Grey, ...]
    held: tuple[Grey, ...]
    after: Grey


def minutes(count: int) -> Iterator[Minute]:
    """Photograph a touch a minute."""
    rng, before = np.random.default_rng((SEED, 7)), None
    for number in range(1, count + 1):
        truth = Truth(bench_after(number), SEED)
        place = rng.uniform(_MARGIN, np.array(SAID.size) - _MARGIN)
        touch = fe.Touch(float(place[0]), float(place[1]), float(rng.uniform(0.5, 4.0)))
        points = truth.later.points
        shown = 0.0 if before is None else _left(*before, points)
        rest, pressed = (truth.displacement(points, touches) for touches in ((), (touch,)))
        alone = tuple(truth.mean_image(rest + shown, number, HELD + 1 + k) for k in range(_REST))
        held = tuple(truth.image(pressed + shown, number, k) for k in range(HELD))
        before = truth, touch
        after = truth.image(rest + truth.bench.leftover * (pressed - rest), number, HELD)
        yield Minute(number, np.array([*place, touch.force]), alone, held, after)


def _left(truth: Truth, touch: fe.Touch, points: F64) -> F64:
    """Compute what a touch that ended leaves in the plate, (K, 3) mm."""
    moved = truth.displacement(points, (touch,)) - truth.displacement(points, ())
    return truth.bench.leftover * moved


class HourSource(FrameSource):
    """Frames of the minutes, with the times at which they would have come.

    Attributes
    ----------
    made : list of Touched
        What touched the plate in the frames that count.
    """

    def __init__(self, count: int):
        self.made = list[Touched]()
        super().__init__(self._all(count), "an hour")

    def _all(self, count: int) -> Iterator[Frame]:
        rest = Truth(AT_FIRST, SEED)
        for number in range(REFERENCES):
            yield Frame(number, number * _INTERVAL, rest.reference(number))
        for minute in minutes(count):
            yield from self._frames_of(minute)

    def _frames_of(self, minute: Minute) -> Iterator[Frame]:
        first = REFERENCES + (minute.number - 1) * (_REST + HELD + 1)
        start = (minute.number - 1) * _MINUTE
        for k, image in enumerate(minute.before, 1):
            yield Frame(first, start + k * _MINUTE / (_REST + 1), image)
            first += 1
        for k, image in enumerate((*minute.held, minute.after)):
            if k >= HELD - 1:
                self.made.append(Touched(first + k, minute.touch if k < HELD else None))
            yield Frame(first + k, start + _MINUTE + k * _INTERVAL, image)


def hour(count: int) -> Iterator[Figure]:
    """Score touches on a bench that changes, and what is found where nothing touches."""
    with tempfile.TemporaryDirectory() as place:
        path = write_scene(Path(place), Path(place) / "touches")
        listed = write_presses(Truth(AT_FIRST, SEED), Path(place) / "presses", 9)
        known = kept(identified(path, listed, listed.with_suffix("")), Path(place))
        scene = rig.load(path)
    source = HourSource(count)
    bench = build_bench(scene, lambda done, total: None, known)
    loop = Loop(bench, source, lambda: source.now)
    found = {one.sequence: one.estimate for one in loop if one.estimate is not None}
    seen = compared(found, source.made, float("nan"))
    learned = loop.summary()["learned"]
    found_in = cells(seen, BARS)
    if count < HOUR:  # a part of an hour has no verdict, and the hour stands as not measured
        unknown = {
            name: (None, *cell[1:3])
            for name, cell in found_in.items()
            if isinstance(cell, tuple) and len(cell) > 2 and cell[2]
        }
        yield from line(TABLE, HOUR_CASE, **unknown)
        found_in = {
            n: cell[:2] if isinstance(cell, tuple) else cell for n, cell in found_in.items()
        }
    yield from line(
        TABLE,
        HOUR_CASE if count >= HOUR else f"{count} minutes of warming, creep and drift",
        **{name: cell for name, cell in found_in.items() if name != "frame"},
        learned=(float(learned["touches"]), "touches"),
        strange=(float(learned["strange"]), "touches"),
    )


PARTS = {"few": partial(hour, 20), "hour": partial(hour, HOUR)}

if __name__ == "__main__":
    run(PARTS, __doc__)

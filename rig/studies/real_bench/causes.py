"""Which cause is named for a bench of which one thing is otherwise, from ordinary touches.

Parts: wrong (five drawings of each thing), right (104 of a bench that is as described), wrong_2
(two of each thing, for a first look). Images are those of `as_it_is`: the whole plate of von
Kármán, single frames at 1024² with a noise of 2 grey levels; of places and forces nothing is known.
A drawing takes up to sixteen of the touches under which its plate was solved and photographs them
anew; drawings of a thing share a pattern and the mean of its reference images, right benches have
thirteen of these. Right: the cause is among those named, which may be several where touches cannot
tell them apart; of a soft clamp, its edge as well.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from pathlib import Path

import numpy as np

import fe
import models
import rig
from fe.reduced.karman import Deflected
from rig.calibration.bench_causes import TOUCHES, diagnosed, shown_touches
from rig.calibration.bench_presses import usual_bench
from rig.calibration.store import Calibration
from rig.live.baseline import average_reference
from rig.live.bench import Bench
from rig.live.chain import Chain
from rig.report.figure import Figure, at_least, at_most
from rig.studies.real_bench.departure import DEPARTURES, SAID, RealBench
from rig.studies.real_bench.session import MARGIN, REFERENCES, write_scene
from rig.studies.real_bench.truth import Truth
from rig.studies.study import line, run
from rig.system.arrays import Grey

TABLE = "The cause is named"
SEED = 104
_IMAGES = 2 * TOUCHES  # of a drawing: some lie too near another
_SOLVED = 24  # touches of a plate, of which each drawing takes some
_SOLVED_RIGHT = 60
_PATTERNS = 13  # of the right benches
_RIGHT_SEED = 300  # none of those from which the rate of false alarms was chosen

_RIGID = fe.Elastic(inf, inf, inf)
_SOFT = fe.Elastic(inf, 400.0, 25.0)
_STAND_OFF = 10.0  # mm: 2 % of the distance


def _soft(edge: str) -> RealBench:
    edges = {name: _RIGID for name in ("west", "east", "south", "north")} | {edge: _SOFT}
    return RealBench(replace(SAID, edges=fe.Edges(**edges)))


ONE_THING: dict[str, tuple[RealBench, str]] = {
    "clamps that give": (DEPARTURES["clamps that give"], "clamps that give"),
    "soft clamp, west": (_soft("west"), "clamps that give"),
    "soft clamp, east": (_soft("east"), "clamps that give"),
    "soft clamp, south": (_soft("south"), "clamps that give"),
    "soft clamp, north": (_soft("north"), "clamps that give"),
    "sag 0.1 mm": (RealBench(replace(SAID, shape=fe.Shape(sag=0.1))), "a plate that is not flat"),
    "0.5 K warmer": (DEPARTURES["0.5 K warmer"], "tension in the plate"),
    "thickness -6 %": (RealBench(replace(SAID, thickness=0.94)), "the thickness"),
    "half of it 5 % thicker": (DEPARTURES["half of it 5 % thicker"], "uneven thickness"),
    "pose 1°, 2 mm": (DEPARTURES["pose 1°, 2 mm"], "the camera's pose"),
    "stand-off +10 mm": (
        RealBench(camera=(0.0,) * 5 + (_STAND_OFF, 0.0, 0.0, 0.0)),
        "the stand-off",
    ),
    "focal length +2 %": (DEPARTURES["focal length +2 %"], "the focal length"),
    "k1 -0.08": (DEPARTURES["k1 -0.08"], "the lens"),
}
"""Benches with one thing otherwise, and the cause that is right; see `models.bench.diagnosis`."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """A bench before its touches: what photographs it, and the loop prepared for its reference.

    Attributes
    ----------
    truth : Truth
    states : list of Deflected
        Of its plate under touches of 0.5 to 4 N anywhere.
    bench : Bench
    chain : Chain
    """

    truth: Truth
    states: list[Deflected]
    bench: Bench
    chain: Chain

    def diagnosis(self, number: int) -> models.Diagnosis:
        """Diagnose one drawing of touches and noise."""
        shown = shown_touches(self.chain, self._images(number))
        return diagnosed(self.bench, self.chain, shown, lambda done, total: None)

    def _images(self, number: int) -> Iterator[tuple[str, Grey]]:
        rng, points = np.random.default_rng((self.truth.seed, 5, number)), self.truth.later.points
        drawn: list[int] = rng.permutation(len(self.states))[:_IMAGES].tolist()
        for one in drawn:
            moved = self.truth.shown(points, self.states[one])
            yield f"touch {one}", self.truth.image(moved, 6, number, one)


def wrong(drawings: int) -> Iterator[Figure]:
    """Count the causes that are named rightly."""
    bench, hits = _usual(), list[bool]()
    for number, (thing, (otherwise, cause)) in enumerate(ONE_THING.items()):
        truth = Truth(otherwise, SEED + number)
        drawn = _drawn(truth, solved(truth, _SOLVED), bench)
        found = [drawn.diagnosis(one) for one in range(drawings)]
        right = [_is_right(thing, cause, one) for one in found]
        yield from _line(thing, right, found)
        hits += right
    fraction = 100.0 * sum(hits) / len(hits)
    yield from line(TABLE, "all of them", right=(fraction, "%", at_least(90.0), len(hits)))


def accused(patterns: int, drawings: int) -> Iterator[Figure]:
    """Count right benches that are accused, and how small their p-values are."""
    bench, states, found = _usual(), list[Deflected](), list[float]()
    for number in range(patterns):
        truth = Truth(RealBench(), _RIGHT_SEED + number)
        states = states or solved(truth, _SOLVED_RIGHT)
        drawn = _drawn(truth, states, bench)
        found += [drawn.diagnosis(one).p_value for one in range(drawings)]
    p_values, count = np.array(found), len(found)
    fraction = 100.0 * float(np.mean(p_values < models.FALSE_ALARM))
    yield from line(
        TABLE,
        "all of them",
        right_bench_accused=(fraction, "%", at_most(1.0), count),
        rate_that_is_stated=(100.0 * models.FALSE_ALARM, "%"),
        smallest_p_of_a_right_bench=(float(p_values.min()), "", None, count),
        p_below_a_tenth=(100.0 * float(np.mean(p_values < 0.1)), "%", None, count),
    )


def _usual() -> Bench:
    with tempfile.TemporaryDirectory() as place:
        scene = rig.load(write_scene(Path(place), Path(place) / "touches"))
    return usual_bench(scene, Calibration(), lambda done, total: None)


def solved(truth: Truth, count: int) -> list[Deflected]:
    """Solve a plate under `count` touches, one at a time."""
    rng, sides = np.random.default_rng((truth.seed, 4)), np.array(SAID.size)
    places, forces = rng.uniform(MARGIN, sides - MARGIN, (count, 2)), rng.uniform(0.5, 4.0, count)
    touches = np.column_stack([places, forces]).tolist()
    return [truth.solved((fe.Touch(x, y, force),)) for x, y, force in touches]


def _drawn(truth: Truth, states: list[Deflected], bench: Bench) -> Drawn:
    reference = average_reference([truth.reference(number) for number in range(REFERENCES)])
    return Drawn(truth, states, bench, bench.prepare(reference)[0])


def _is_right(thing: str, cause: str, found: models.Diagnosis) -> bool:
    """Whether the cause is named, and of a soft clamp its edge as that which gives most."""
    named = {each.name: each.largest for each in found.named}
    edge = thing.removeprefix("soft clamp, ")
    return cause in named and (edge == thing or f"_{edge} " in named[cause])


def _line(thing: str, hits: list[bool], found: list[models.Diagnosis]) -> Iterator[Figure]:
    names = [" or ".join(each.name for each in one.named) or "nothing" for one in found]
    right = (100.0 * sum(hits) / len(hits), "%", None, len(hits))
    yield from line(TABLE, thing, right=right, named="; ".join(dict.fromkeys(names)))


PARTS = {
    "wrong": partial(wrong, 5),
    "right": partial(accused, _PATTERNS, 8),
    "wrong_2": partial(wrong, 2),
}

if __name__ == "__main__":
    run(PARTS, __doc__)

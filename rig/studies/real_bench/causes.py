"""Which cause is named for a bench of which one thing is otherwise, from ordinary touches.

Parts: few (two drawings of each thing, four of a bench that is as described), many (twelve and a
hundred). Images are those of `as_it_is`: the whole plate of von Kármán, single frames with a noise
of 2 grey levels; of places and forces nothing is known. Right: the cause is among those named,
which may be several where touches cannot tell them apart.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import fe
import models
import rig
from rig.calibration.bench_causes import TOUCHES, diagnose_images
from rig.calibration.store import Calibration
from rig.report.figure import Figure, at_least, at_most
from rig.studies.real_bench.departure import DEPARTURES, SAID, RealBench
from rig.studies.real_bench.session import write_scene, write_touches
from rig.studies.real_bench.truth import Truth
from rig.studies.study import line, run

TABLE = "The cause is named"
SEED = 100
_IMAGES = 2 * TOUCHES  # some lie too near another

ONE_THING: dict[str, tuple[RealBench, str]] = {
    "clamps that give": (DEPARTURES["clamps that give"], "clamps that give"),
    "one soft clamp": (DEPARTURES["one soft clamp"], "clamps that give"),
    "sag 0.1 mm": (RealBench(replace(SAID, shape=fe.Shape(sag=0.1))), "a plate that is not flat"),
    "0.5 K warmer": (DEPARTURES["0.5 K warmer"], "tension in the plate"),
    "half of it 5 % thicker": (DEPARTURES["half of it 5 % thicker"], "uneven thickness"),
    "pose 1°, 2 mm": (DEPARTURES["pose 1°, 2 mm"], "the camera's pose"),
    "focal length +2 %": (DEPARTURES["focal length +2 %"], "the focal length"),
    "k1 -0.08": (DEPARTURES["k1 -0.08"], "the lens"),
}
"""Benches with one thing otherwise, and the cause that is right; see `models.bench.diagnosis`."""


def causes(drawings: int, right: int) -> Iterator[Figure]:
    """Count the causes that are named rightly, and the right benches that are accused."""
    named_rightly, tried = 0, 0
    for thing, (bench, cause) in ONE_THING.items():
        found = [_named(bench, SEED + number) for number in range(drawings)]
        hits = sum(cause in names for names in found)
        yield from line(
            TABLE,
            thing,
            right=(100.0 * hits / drawings, "%", None, drawings),
            named="; ".join(" or ".join(names) or "nothing" for names in dict.fromkeys(found)),
        )
        named_rightly, tried = named_rightly + hits, tried + drawings
    accused = [_named(RealBench(), SEED + number) for number in range(right)]
    yield from line(
        TABLE,
        "all of them",
        right=(100.0 * named_rightly / tried, "%", at_least(90.0), tried),
        right_bench_accused=(100.0 * sum(map(bool, accused)) / right, "%", at_most(1.0), right),
    )


def _named(bench: RealBench, seed: int) -> tuple[str, ...]:
    """Causes that are named from some touches on a bench."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        write_touches(Truth(bench, seed), folder / "touches", _IMAGES)
        return tuple(cause.name for cause in _diagnosis(folder).named)


def _diagnosis(folder: Path) -> models.Diagnosis:
    scene = rig.load(write_scene(folder, folder / "touches"))
    return diagnose_images(scene, Calibration(), folder / "touches", lambda done, total: None)


PARTS = {"few": partial(causes, 2, 4), "many": partial(causes, 12, 100)}

if __name__ == "__main__":
    run(PARTS, __doc__)

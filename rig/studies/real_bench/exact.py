"""A bench of which nothing is wrong and nothing unknown, with and without inference of it.

Parts: exact, thick. The same images of 400 touches are read by an estimator that takes the scene
for granted (`estimator.bench = "exact"`, `plate.theory = "large"`) and by one that infers a bench
of which every number is known; how far the plate in modes is off beside them it says as nine
presses on this bench show it. *Worse by*: the largest of what the second one has more of: place
(median, p95) and force in per cent of the first one's, and in points of a hundred frames of another
number of touches and what coverage is off 68 and 95 %. Thick: what the first one finds on a plate
of 2 mm, which one frame cannot be better than. Truth is the whole plate of von Kármán on its own
mesh.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import models
import rig
from rig.calibration.store import Calibration
from rig.report.figure import Figure, at_most
from rig.studies.real_bench.as_it_is import NONE, cells, identified, kept, photographed
from rig.studies.real_bench.departure import SAID, RealBench
from rig.studies.real_bench.score import Score, score
from rig.studies.real_bench.session import write_presses, write_scene, write_touches
from rig.studies.real_bench.truth import Truth
from rig.studies.study import line, run

SEED, TOUCHES = 3, 400
TABLE = "Nothing wrong, nothing unknown"
EXACT = {"estimator.bench": "exact", "plate.theory": "large"}
_THICK = 2.0  # mm
_COVERED = (1.0, 68.27), (2.0, 95.45)  # σ, % of a normal error


def exact() -> Iterator[Figure]:
    """Score the same images by both estimators."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        truth = Truth(RealBench(), SEED)
        made = write_touches(truth, folder / "touches", TOUCHES)
        path = write_scene(folder, folder / "touches")
        listed = write_presses(truth, folder / "presses", 9)
        granted = score(rig.load(path, EXACT), Calibration(), made)
        inferred = score(rig.load(path), kept(known(path, listed), folder), made)
    yield from line(TABLE, "scene taken for granted", **cells(granted, NONE))
    yield from line(TABLE, "bench inferred, all of it known", **cells(inferred, NONE))
    worse = worse_by(granted, inferred)
    for name, value in worse.items():
        yield from line(TABLE, f"{name}, worse by", figure=(value, "%"))
    yield from line(
        TABLE,
        "right model, nothing wrong: any figure worse by",
        figure=(max(worse.values()), "%", at_most(3.0), len(granted.place)),
    )


def known(scene: Path, listed: Path) -> models.BenchEstimate:
    """State a bench that is as described, every number of it, and how well presses fit it."""
    found, count = identified(scene, listed, listed.with_suffix("")), len(models.BENCH)
    return replace(found, values=np.zeros(count), covariance=np.zeros((count, count)), memory=0.0)


def thick() -> Iterator[Figure]:
    """Score touches on a plate of 2 mm by the estimator that takes the scene for granted."""
    bench = RealBench(replace(SAID, thickness=_THICK), said_thickness=_THICK)
    with tempfile.TemporaryDirectory() as place:
        _, path, made = photographed(bench, SEED, Path(place), TOUCHES)
        granted = score(rig.load(path, EXACT), Calibration(), made)
    yield from line(
        TABLE, f"plate of {_THICK:g} mm, scene taken for granted", **cells(granted, NONE)
    )


def worse_by(granted: Score, inferred: Score) -> dict[str, float]:
    """Compute how much worse each figure of the second is, %; below 0 where it is better."""
    one, two = _figures(granted), _figures(inferred)
    fractions = {name: 100.0 * (two[name] / one[name] - 1.0) for name in one}
    return fractions | {
        name: each - _points(granted)[name] for name, each in _points(inferred).items()
    }


def _figures(seen: Score) -> dict[str, float]:
    return {
        "place, median": float(np.median(seen.place)),
        "place, p95": float(np.quantile(seen.place, 0.95)),
        "force": float(np.median(np.abs(seen.force))),
    }


def _points(seen: Score) -> dict[str, float]:
    """Figures that are fractions already, %: wrong numbers of touches, and coverage that is off."""
    frames = len(seen.place) + seen.missed + seen.alone
    wrong = {"number": 100.0 * (seen.missed + seen.phantoms + seen.false) / frames}
    for sigma, fraction in _COVERED:
        inside = 100.0 * float(np.mean(np.abs(seen.within) < sigma))
        wrong[f"inside {sigma:g} σ"] = abs(inside - fraction)
    return wrong


PARTS = {"exact": exact, "thick": thick}

if __name__ == "__main__":
    run(PARTS, __doc__)

"""Touches on a bench that is not as its scene says, before and after presses.

Parts, with 67 touches a seed, 201 a row: together (all of it, after nine presses, twenty, and 30
touches of which nothing is known but one weight of 2 N), each (each thing alone), surrounded
(light, lens, hand, dirt and the finger's pad, each alone), others (a gamma, a rolling shutter, a
camera below, a plate of 2 mm, two edges clamped). together_16, each_16, surrounded_16, others_16:
the same with 16 touches a seed, for a first look. counted: phantoms and false touches on the bench
on which all is wrong, 200 frames of touches and 200 of the plate alone a seed. Three seeds a row:
presses, their labels, touches and noise are drawn anew, since what the labels do to a bench is the
same for all touches on it. many_seeds: for that reason three say little of σ; twelve other seeds of
the bench on which all is wrong, 17 touches each.

Truth is the whole plate of von Kármán on its own mesh of 40 elements with edges that give,
photographed at 1024² with a noise of 2 grey levels; the estimator has the scene and presses of 12
frames, whose list errs by 0.2 mm and 0.3 %. Inside 1 and 2 σ: x, y and F each, of touches that are
FOUND. Under the rolling shutter forces change by a tenth in a frame.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

import models
import rig
from rig.calibration import bench_presses, store
from rig.calibration.bench_refusal import require_sound
from rig.calibration.steps import plate_of
from rig.calibration.store import Calibration, read_calibration
from rig.report.figure import Bar, Figure, at_most
from rig.studies.real_bench.departure import ALL, BENCHES, DEPARTURES, SURROUNDED, RealBench
from rig.studies.real_bench.score import Score, pooled, score
from rig.studies.real_bench.session import (
    Touched,
    write_ordinary,
    write_presses,
    write_scene,
    write_touches,
)
from rig.studies.real_bench.truth import Truth
from rig.studies.study import Cell, Part, line, run

TABLE = "The bench as it is"
MANY, FEW = 67, 16  # touches of a seed
COUNTED, ALONE = 200, 5  # touches of a seed, and frames alone after every five of them
SEEDS = 3, 4, 5
MANY_SEEDS, OF_MANY = range(6, 18), 17  # and touches of each
TOGETHER_NAME = "all wrong together"
INSIDE = Bar(60.0, 76.0), Bar(90.0, 100.0)
ONE = at_most(0.25), at_most(0.6), at_most(1.0)
TOGETHER = at_most(0.4), at_most(1.0), at_most(1.5)
TWENTY = at_most(0.25), at_most(0.6), at_most(1.0)
UNKNOWN = at_most(0.5), at_most(1.0), at_most(2.0)
Bars = tuple[Bar | None, Bar | None, Bar | None]
NONE: Bars = (None, None, None)


def each(touches: int) -> Iterator[Figure]:
    """Score one thing after the other."""
    for name, bench in DEPARTURES.items():
        yield from departure(bench, name, touches, ONE)


def surrounded(touches: int) -> Iterator[Figure]:
    """Score what lies between the plate and its image."""
    for name, bench in SURROUNDED.items():
        yield from departure(bench, name, touches, ONE)


def others(touches: int) -> Iterator[Figure]:
    """Score other benches."""
    for name, bench in BENCHES.items():
        yield from departure(bench, name, touches, ONE)


def together(touches: int) -> Iterator[Figure]:
    """Score the bench on which all is wrong."""
    yield from departure(ALL, TOGETHER_NAME, touches, TOGETHER)
    yield from twenty(touches)
    yield from ordinary(touches)


def departure(bench: RealBench, name: str, touches: int, bars: Bars) -> Iterator[Figure]:
    """Score touches on a bench as it is, before and after nine presses."""
    seen = [nominal_and_after(bench, seed, touches) for seed in SEEDS]
    nominal, after = pooled([one for one, _ in seen]), [each for _, each in seen]
    yield from line(TABLE, f"{name}, nominal scene", **cells(nominal, NONE))
    yield from judged(f"{name}, after 9 presses", after, bars, at_most(20.0))


def nominal_and_after(bench: RealBench, seed: int, touches: int) -> tuple[Score, Calibrated]:
    """Score the same touches before and after nine presses."""
    with tempfile.TemporaryDirectory() as place:
        truth, scene, made = photographed(bench, seed, Path(place), touches)
        nominal = score(rig.load(scene), Calibration(), made)
        listed = write_presses(truth, scene.parent / "presses", 9)
        return nominal, calibrated(scene, listed, made)


def twenty(touches: int) -> Iterator[Figure]:
    """Score touches on a bench that twenty presses have shown."""
    case = f"{TOGETHER_NAME}, after 20 presses"
    after = [after_presses(partial(write_presses, count=20), seed, touches) for seed in SEEDS]
    yield from judged(case, after, TWENTY, at_most(40.0))


def many_seeds() -> Iterator[Figure]:
    """Score a few touches on each of many benches on which all is wrong, after nine presses."""
    pressed = partial(write_presses, count=9)
    after = [after_presses(pressed, seed, OF_MANY) for seed in MANY_SEEDS]
    case = f"{TOGETHER_NAME}, after 9 presses, {len(MANY_SEEDS)} seeds"
    yield from line(TABLE, case, **cells(pooled([one.score for one in after]), TOGETHER))


def ordinary(touches: int) -> Iterator[Figure]:
    """Score touches on a bench that touches of unknown place and force have shown."""
    case = f"{TOGETHER_NAME}, 30 ordinary touches and a weight"
    after = [after_presses(partial(write_ordinary, count=30), seed, touches) for seed in SEEDS]
    yield from judged(case, after, UNKNOWN, None)


def after_presses(write: Callable[[Truth, Path], Path], seed: int, touches: int) -> Calibrated:
    """Score touches on a bench on which all is wrong, that some presses have shown."""
    with tempfile.TemporaryDirectory() as place:
        truth, scene, made = photographed(ALL, seed, Path(place), touches)
        return calibrated(scene, write(truth, scene.parent / "presses"), made)


def photographed(
    bench: RealBench, seed: int, folder: Path, touches: int
) -> tuple[Truth, Path, list[Touched]]:
    """Photograph touches on a bench; with the scene that reads the images."""
    truth = Truth(bench, seed)
    made = write_touches(truth, folder / "touches", touches)
    return truth, write_scene(folder, folder / "touches", bench), made


def counted() -> Iterator[Figure]:
    """Count what is found that is not there, on a bench that twenty presses have shown."""
    seen: list[Score] = []
    for seed in SEEDS:
        with tempfile.TemporaryDirectory() as place:
            truth, folder = Truth(ALL, seed), Path(place)
            made = write_touches(truth, folder / "touches", COUNTED, ALONE)
            listed = write_presses(truth, folder / "presses", 20)
            scene = write_scene(folder, folder / "touches", ALL)
            seen.append(calibrated(scene, listed, made).score)
    found, none = pooled(seen), at_most(0.0)
    touched = len(found.place) + found.missed
    yield from line(
        TABLE,
        f"{TOGETHER_NAME}, after 20 presses",
        phantoms_in_600_frames=(found.phantoms, "", none, touched),
        false_touches_in_500_empty_frames=(found.false, "", none, found.alone),
    )


class Calibrated(NamedTuple):
    """Touches on a bench that presses have shown, and what finding it took, CPU s."""

    score: Score
    seconds: float


def calibrated(scene: Path, listed: Path, made: list[Touched]) -> Calibrated:
    """Score touches on a bench that presses have shown."""
    began = time.process_time()
    found = identified(scene, listed, listed.with_suffix(""))
    spent = time.process_time() - began
    return Calibrated(score(rig.load(scene), kept(found, scene.parent), made), spent)


def identified(scene: Path, listed: Path, images: Path) -> models.BenchEstimate:
    """Find the bench as ``touchplate calibrate bench`` does, which refuses one that cannot be."""
    read, presses = rig.load(scene), bench_presses.read_list(listed)
    found = bench_presses.identify_bench(
        read, Calibration(), presses, images, (), lambda done, total: None
    )
    require_sound(found, plate_of(read).size)
    return found


def kept(found: models.BenchEstimate, folder: Path) -> Calibration:
    """Keep a bench in a file and read it again."""
    path = folder / "calibration.json"
    store.keep(path, found)
    return read_calibration(path)


def judged(
    case: str, after: Sequence[Calibrated], bars: Bars, seconds: Bar | None
) -> Iterator[Figure]:
    """Figures of touches on benches that presses have shown, one of each seed."""
    spent = float(np.median([one.seconds for one in after]))
    yield from line(TABLE, case, identification=(spent, "CPU s", seconds, len(after)))
    yield from line(TABLE, case, **cells(pooled([one.score for one in after]), bars))


def cells(seen: Score, bars: Bars) -> dict[str, Cell]:
    """Give what a run found as cells of a line."""
    count, inside = len(seen.place), np.abs(seen.within)
    touched = count + seen.missed
    one, two = (100.0 * float(np.mean(inside < limit)) for limit in (1.0, 2.0))
    return {
        "place, median": (float(np.median(seen.place)), "mm", bars[0], count),
        "place, p95": (float(np.quantile(seen.place, 0.95)), "mm", bars[1], count),
        "force": (100.0 * float(np.median(np.abs(seen.force))), "%", bars[2], count),
        "inside 1 σ": (one, "%", INSIDE[0], len(inside)),
        "inside 2 σ": (two, "%", INSIDE[1], len(inside)),
        "not sure": (100.0 * (1.0 - len(inside) / max(count, 1)), "%", None, count),
        "frames with a phantom": (100.0 * seen.phantoms / touched, "%", at_most(1.0), touched),
        "missed": (100.0 * seen.missed / touched, "%", None, touched),
        "false touches": (seen.false, "", at_most(0.0), seen.alone),
        "frame": (1e3 * seen.seconds, "CPU ms"),
    }


ROWS = {"together": together, "each": each, "surrounded": surrounded, "others": others}
PARTS: dict[str, Part] = {
    **{name: partial(rows, MANY) for name, rows in ROWS.items()},
    **{f"{name}_{FEW}": partial(rows, FEW) for name, rows in ROWS.items()},
    "counted": counted,
    "many_seeds": many_seeds,
}

if __name__ == "__main__":
    run(PARTS, __doc__)

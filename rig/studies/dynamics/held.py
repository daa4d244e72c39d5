"""A press of 2 N that is held for a minute on a plate that creeps by 5 %, and let go.

Parts: held. The plate is that of `creeping`, a solid with three branches, each with a Poisson's
ratio of its own; two terms of creep are learned from one press of 1.5 N elsewhere, whose force
nobody measured. Tile sums and noise are those of `seen`, ten frames a second. In some cases the
plate bows as well while it is pressed, by its lowest mode: a drift, which is followed under the
press or only without one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

import fe
import models
from models import Creep, Estimator
from rig.live.baseline import drift_weight, update_drift
from rig.live.plate_in_time import MeasuredFrame, Past, PlateInTime
from rig.live.tracks import Tracks
from rig.report.figure import Bar, Figure, at_most
from rig.studies.dynamics.creeping import crept_readings
from rig.studies.dynamics.seen import SeenPlate, prepare_seen
from rig.studies.study import line, run
from rig.system.arrays import F64

Way = tuple[Creep | None, float, bool]
"""Creep that is known, bow, N, and whether a drift is followed under a press."""
STEP, DURATION = 0.1, 121.0  # s
LANDS, LEAVES, RAMP = 1.0, 61.0, 0.3  # s
ELEMENTS = 24
TRAINED_AT, TRAINED_BY = (90.0, 150.0), 1.5  # mm, N
PLACES, FORCE = ((150.0, 100.0), (70.0, 80.0), (127.0, 190.0)), 2.0
GHOST = 0.02  # N
BOW = 0.04  # N on the middle, as by which the plate bows in the minute
WITHIN, NO_GHOST = at_most(2.0), at_most(GHOST)


def _pressed(force: float, time: float) -> float:
    return force * float(np.clip(min(time - LANDS, LEAVES - time) / RAMP, 0.0, 1.0))


def held() -> Iterator[Figure]:
    """Learn creep from one press, then follow others."""
    seen = prepare_seen(2.0, 1024)
    mesh = fe.grid(seen.bench.plate, ELEMENTS)
    readings = seen.readings(mesh)

    def creeping(place: tuple[float, float], force: float) -> F64:
        press: Callable[[float], float] = partial(_pressed, force)
        at = np.array(place)
        return crept_readings(seen.bench.plate, mesh, readings, at, press, STEP, DURATION)

    first = creeping(TRAINED_AT, TRAINED_BY)
    known = _learned(seen, first)
    for (part, time), name in zip(
        zip(known.creep.parts, known.creep.times, strict=True), ("quick", "slow"), strict=True
    ):
        yield from line(
            "Creep, learned from one press",
            f"{name} term",
            part=(100 * part, "%", None, 1),
            time=(time, "s", None, 1),
        )
    everywhere = [creeping(place, FORCE) for place in PLACES]
    bowing = f"the plate bows by {BOW:g} N"
    cases = {
        "creep followed": (known.creep, 0.0, True),
        "creep not followed": (None, 0.0, True),
        f"creep and drift followed, {bowing}": (known.creep, BOW, True),
        f"creep followed, drift not under the press, {bowing}": (known.creep, BOW, False),
    }
    for name, (creep, bow, drifts) in cases.items():
        barred = name == "creep followed"
        yield from _lines(seen, everywhere, (creep, bow, drifts), f"2 N held 60 s, {name}", barred)


def _learned(seen: SeenPlate, exact: F64) -> models.LearnedCreep:
    shape = seen.pattern.forward(seen.noise).response(np.array([TRAINED_AT]))[0]
    noisy = exact + np.random.default_rng(0).standard_normal(exact.shape)
    times = np.arange(len(exact), dtype=np.float64) * STEP
    shown = noisy @ shape / (shape @ shape)
    return models.learn_creep(times, shown, LEAVES, float(1 / np.linalg.norm(shape)))


def _lines(
    seen: SeenPlate, everywhere: list[F64], way: Way, case: str, barred: bool
) -> Iterator[Figure]:
    errors: list[float] = []
    tracked: list[float] = []
    scaled: list[float] = []
    ghosts: list[float] = []
    for number, exact in enumerate(everywhere):
        for time, force, sigma, shown in _followed(seen, exact, way, number):
            if LANDS + RAMP < time < LEAVES - RAMP:
                errors.append(force / FORCE - 1)
                tracked.append(shown / FORCE - 1)
                scaled.append((force - FORCE) / max(sigma, 1e-9))
            elif time > LEAVES:
                ghosts.append(force)
    error, away = 100 * np.abs(errors), np.abs(scaled)
    bars: tuple[Bar | None, Bar | None] = (WITHIN, NO_GHOST) if barred else (None, None)
    yield from line(
        "A press that is held",
        case,
        force_worst=(float(error.max()), "% off", bars[0], len(error)),
        tracked_worst=(100 * float(np.abs(tracked).max()), "% off", bars[0], len(error)),
        force=(float(np.median(error)), "% off, median", None, len(error)),
        within_σ=(100 * float((away < 1).mean()), "%", None, len(away)),
        after_release=(float(np.max(ghosts)), "N, largest", bars[1], len(ghosts)),
        false_after=(float(np.sum(np.array(ghosts) > 0)), "frames", None, len(ghosts)),
    )


def _followed(
    seen: SeenPlate, exact: F64, way: Way, number: int
) -> Iterator[tuple[float, float, float, float]]:
    """Follow a press as the live loop does: time, force and σ of each frame, and force tracked."""
    creep, bow, drifts = way
    rng, past, rest = np.random.default_rng(number + 1), Past(), np.zeros(seen.modes.count)
    estimator = Estimator(seen.pattern.forward(seen.noise), max_touches=2)
    plate, start = PlateInTime(None, creep), np.empty((0, 3))
    factor, tracks = seen.pattern.factor, Tracks()
    middle = np.array([seen.bench.plate.size]) / 2
    bent = seen.modes.response(middle)[0] * (np.arange(seen.modes.count) == 0)
    for frame, y in enumerate(exact):
        time = frame * STEP
        drifted = bow * min(time / LEAVES, 1.0) * bent
        measured = y + rng.standard_normal(len(y)) + (drifted - rest) @ factor / seen.noise
        exposed = MeasuredFrame(measured, factor, seen.noise, time, seen.pattern.motions)
        found = plate.estimate(estimator, exposed, start, past)
        past, estimate = found.past, found.estimate
        start = np.column_stack([estimate.xy, estimate.force])
        if found.left is not None and (drifts or not estimate.count):
            weight = drift_weight(STEP)
            rest = update_drift(rest, seen.pattern, found.left, seen.noise, weight)
        sigma = float(np.sqrt(estimate.touch_covariance(0)[2, 2])) if estimate.count else 0.0
        tracks, _, _ = tracks.follow(estimate, time)
        shown = max((track.force for track in tracks.tracks), default=0.0)
        yield time, float(estimate.force.sum()), sigma, shown


PARTS = {"held": held}

if __name__ == "__main__":
    run(PARTS, __doc__)

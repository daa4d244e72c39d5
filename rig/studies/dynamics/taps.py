"""Taps on plates that ring: the largest force, and nothing where nothing touches any more.

Parts: one (a plate of 1 mm), two (of 2 mm), steady (what following costs a touch that rests). The
plate is that of `vibrating`, its tile sums those of `seen` with the noise of the twin's sensor; a
finger presses as half a sine, or quickly and then slowly off. Density and damping are supposed 6 %
and 100 % off and learned from one harder tap at the same rate. Forces are those of linear theory:
0.2 N on 1 mm, 1 N on 2 mm. A peak that the estimator says it cannot know counts as infinitely far
off; then it states a bound.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np

import fe
import models
from models import Estimate, Estimator, InTime, Result, RingingPlate, Seeing
from rig.report.figure import Bar, Figure, at_most
from rig.studies.dynamics.seen import SeenPlate, prepare_seen
from rig.studies.dynamics.vibrating import KEPT, STEP, Damping, summed_readings
from rig.studies.study import Cell, line, rms, run, timed
from rig.system.arrays import F64, Mask

DENSITY, DAMPING = 1400.0, 0.02  # kg/m³; at the first and the ninth frequency, less between
SUPPOSED = 1250.0, 0.04  # what a scene says that does not know better
ELEMENTS, DURATION, LANDS = 24, 0.6, 0.05  # of the truth; s; s
TAPS = (0.1, 0.05, 0.02)  # s
BARS = {0.1: at_most(2.0), 0.05: at_most(5.0), 0.02: at_most(15.0)}  # %
RATES, EXPOSURE = (30.0, 120.0), 0.008
PLACES, PHASES, HARDER = 18, 4, 5.0
FORCES = {1.0: 0.2, 2.0: 1.0}  # N, by mm
ONE_SIGMA, TWO_SIGMA, NONE = Bar(60.0, 76.0), Bar(90.0, 100.0), at_most(0.0)
STEADY_PRESSES, STEADY_FRAMES = 8, 30


@dataclass(frozen=True, eq=False)
class Plate:
    """A plate and what it shows under taps of 1 N: integrals over time, (steps, n, m)."""

    seen: SeenPlate
    seeing: Seeing
    estimator: Estimator
    places: F64
    shapes: tuple[tuple[str, float], ...]
    summed: F64

    def frames(
        self, tap: int, force: float, rate: float, phase: float, exposure: float
    ) -> Iterator[tuple[float, F64]]:
        """Give the end of each exposure, s, and what it measures, without noise."""
        grain, time = KEPT * STEP, exposure + phase
        while time < DURATION - grain:
            total = self._integral(tap, time) - self._integral(tap, time - exposure)
            yield time, force / exposure * total
            time += 1.0 / rate

    def _integral(self, tap: int, time: float) -> F64:
        whole, part = divmod(time / (KEPT * STEP), 1.0)
        first = int(whole)
        return (1 - part) * self.summed[first, tap] + part * self.summed[first + 1, tap]


@dataclass
class Found:
    """What is found of the taps of one kind."""

    peaks: list[float] = field(default_factory=list[float])
    beyond: list[bool] = field(default_factory=list[bool])
    scaled: list[float] = field(default_factory=list[float])
    places: list[float] = field(default_factory=list[float])
    alone: list[float] = field(default_factory=list[float])
    forces: list[float] = field(default_factory=list[float])
    after: list[bool] = field(default_factory=list[bool])
    after_alone: list[bool] = field(default_factory=list[bool])
    spent: list[float] = field(default_factory=list[float])


def pressed(shape: str, age: F64 | float, duration: float) -> F64:
    """Force of a tap of 1 N at an age, s."""
    phase = np.clip(np.asarray(age) / duration, 0.0, 1.0)
    if shape == "half a sine":
        return np.sin(np.pi * phase)
    return np.square(np.sin(np.pi * phase**0.65))


def prepare(thickness: float) -> Plate:
    """Tap a plate at all places in all ways."""
    seen = prepare_seen(thickness, 1024)
    plate, mesh = seen.bench.plate, fe.grid(seen.bench.plate, ELEMENTS)
    rng = np.random.default_rng(7)
    spots = rng.uniform(50.0, 204.0, (PLACES, 2))
    shapes = tuple((shape, tap) for shape in ("half a sine", "quick, then slow") for tap in TAPS)
    places = np.tile(spots, (len(shapes), 1))
    kinds = np.repeat(np.arange(len(shapes)), PLACES)
    pitch = models.plate_dynamics(seen.modes, DENSITY, DAMPING).omega / (2 * np.pi)

    def forces(time: float) -> F64:
        each = [float(pressed(shape, time - LANDS, tap)) for shape, tap in shapes]
        return np.array(each)[kinds]

    summed = summed_readings(
        plate,
        mesh,
        1e-12 * DENSITY,
        Damping(DAMPING, float(pitch[0]), float(pitch[8])),
        seen.readings(mesh),
        places,
        forces,
        DURATION,
    )
    seeing = Seeing(seen.modes, seen.pattern.factor / seen.noise)
    estimator = Estimator(seen.pattern.forward(seen.noise), max_touches=2)
    return Plate(seen, seeing, estimator, places, shapes, summed)


def learned(plate: Plate, force: float, rate: float, exposure: float) -> models.LearnedDamping:
    """Learn how the plate rings from one hard tap, knowing little before."""
    supposed = models.plate_dynamics(plate.seen.modes, *SUPPOSED)
    rng, tap = np.random.default_rng(3), PLACES * TAPS.index(0.02)
    frames = plate.frames(tap, HARDER * force, rate, 0.0, exposure)
    rung = [(time, y) for time, y in frames if time - exposure > LANDS + 0.02]
    measured = np.array([y + rng.standard_normal(len(y)) for _, y in rung])
    times = np.array([time for time, _ in rung])
    return models.learn_damping(supposed, plate.seeing, measured, times, exposure)


def taps(thickness: float) -> Iterator[Figure]:
    """Tap a plate, look on at both rates."""
    plate, force = prepare(thickness), FORCES[thickness]
    for rate in RATES:
        longest = 1.0 / rate
        for exposure in (EXPOSURE,) if rate > 100 else (EXPOSURE, longest):
            # An exposure as long as a period shows no ringing: then what shorter ones showed holds.
            known = learned(plate, force, rate, EXPOSURE)
            case = f"{thickness:g} mm, {rate:g} frames/s, exposed {1e3 * exposure:.3g} ms"
            yield from line(
                "Ringing, learned from one tap",
                case,
                frequency=(100 * (known.frequency * _off(plate) - 1), "% off", None, 1),
                damping=(known.damping, "of critical", None, 1),
                sigma=(known.sigma[1], "of critical", None, 1),
            )
            ringing = RingingPlate(plate.seen.modes, known.dynamics, exposure)
            for number, (shape, tap) in enumerate(plate.shapes):
                found = Found()
                for place in range(PLACES):
                    for phase in np.arange(PHASES) / PHASES / rate:
                        seed = (number, place, round(1e6 * phase))
                        index = number * PLACES + place
                        _tapped(plate, ringing, index, force, (rate, float(phase)), seed, found)
                bar = BARS[tap] if shape == "half a sine" and exposure == EXPOSURE else None
                yield from _lines(f"{case}, {1e3 * tap:g} ms, {shape}", found, bar)


def _off(plate: Plate) -> float:
    """Frequencies that were supposed over those of the truth."""
    supposed = models.plate_dynamics(plate.seen.modes, *SUPPOSED).omega[0]
    return float(supposed / models.plate_dynamics(plate.seen.modes, DENSITY, DAMPING).omega[0])


def _tapped(
    plate: Plate,
    ringing: RingingPlate,
    index: int,
    force: float,
    clock: tuple[float, float],
    seed: tuple[int, int, int],
    found: Found,
) -> None:
    """Follow one tap, each frame also by itself."""
    shape, duration = plate.shapes[index // PLACES]
    rng, state, largest = np.random.default_rng(seed), InTime(), 0.0
    taps: list[models.Tap] = []
    inner = (np.arange(80) + 0.5) / 80
    for time, exact in plate.frames(index, force, *clock, ringing.exposure):
        y = exact + rng.standard_normal(len(exact))
        work = partial(
            models.estimate_in_time, ringing, plate.estimator, plate.seeing, y, state, time
        )
        (estimate, state), spent = timed(work)
        alone = plate.estimator.fit_whitened(y)
        taps += state.taps
        if state.bank is not None:
            found.spent.append(spent)
        if alone.result is Result.FOUND:
            largest = max(largest, float(alone.force.max()))
        ages = time - ringing.exposure * (1 - inner) - LANDS
        mean = force * float(pressed(shape, ages, duration).mean())
        if ages[0] > duration:
            found.after.append(estimate.count > 0)
            found.after_alone.append(alone.count > 0)
        elif estimate.count == 1 and mean > 0.1 * force:
            found.forces.append((float(estimate.force[0]) - mean) / _sigma(estimate))
    found.alone.append(largest / force - 1)
    _score(taps, plate.places[index], force, found)


def _sigma(estimate: Estimate) -> float:
    return float(np.sqrt(estimate.touch_covariance(0)[2, 2]))


def _score(taps: list[models.Tap], place: F64, force: float, found: Found) -> None:
    """Compare the strongest tap that was stated with the true one."""
    known = [tap for tap in taps if np.isfinite(tap.force)]
    found.beyond.append(any(tap.at_least > 1.01 * force for tap in taps))
    if not known:
        found.peaks.append(np.inf)
        return
    best = max(known, key=lambda tap: tap.force)
    found.peaks.append(best.force / force - 1)
    found.scaled.append((best.force - force) / best.sigma[2])
    found.places.append(float(np.hypot(best.x - place[0], best.y - place[1])))


def _percent(right: Mask, bar: Bar | None = None) -> Cell:
    return 100 * float(right.mean()) if len(right) else None, "%", bar, len(right)


def _lines(case: str, found: Found, bar: Bar | None) -> Iterator[Figure]:
    error, scaled = 100 * np.abs(found.peaks), np.abs(found.scaled)
    within = np.abs(found.forces)
    stated = np.isfinite(error)
    yield from line(
        "Taps: largest force",
        case,
        peak=(float(np.median(error)), "% off, median", bar, len(error)),
        peak_95=(float(np.percentile(error, 95)) if stated.all() else None, "%", None, len(error)),
        stated=(100 * float(stated.mean()), "% of taps", None, len(error)),
        bounds_exceeded=(float(np.sum(found.beyond)), "taps", None, len(error)),
        within_σ=_percent(scaled < 1),
        within_2_σ=_percent(scaled < 2),
        place=(float(np.median(found.places)) if found.places else None, "mm", None, len(scaled)),
        one_frame_alone=(100 * float(np.median(np.abs(found.alone))), "% off", None, len(error)),
    )
    held = ONE_SIGMA if bar else None, TWO_SIGMA if bar else None
    yield from line(
        "Taps: frame by frame",
        case,
        force_within_σ=_percent(within < 1, held[0]),
        force_within_2_σ=_percent(within < 2, held[1]),
        false_after=(
            float(np.sum(found.after)),
            "frames",
            NONE if bar else None,
            len(found.after),
        ),
        false_alone=(float(np.sum(found.after_alone)), "frames", None, len(found.after)),
        time=(
            float(np.median(found.spent)),
            "ms, median",
            at_most(1.0) if bar else None,
            len(found.spent),
        ),
        time_95=(float(np.percentile(found.spent, 95)), "ms", None, len(found.spent)),
    )


def steady() -> Iterator[Figure]:
    """Hold touches still, with and without following: errors of both on the same noise."""
    seen = prepare_seen(2.0, 1024)
    forward = seen.pattern.forward(seen.noise)
    estimator = Estimator(forward, max_touches=2)
    seeing = Seeing(seen.modes, seen.pattern.factor / seen.noise)
    ringing = RingingPlate(
        seen.modes, models.plate_dynamics(seen.modes, DENSITY, DAMPING), EXPOSURE
    )
    mesh = fe.grid(seen.bench.plate, 2 * ELEMENTS)
    plate, readings = fe.Linear(seen.bench.plate, mesh), seen.readings(mesh)
    for rate in RATES:
        rng = np.random.default_rng(5)
        errors: tuple[list[F64], list[F64]] = ([], [])
        counts = [0, 0]
        for _ in range(STEADY_PRESSES):
            x, y = rng.uniform(50.0, 204.0, 2)
            truth = np.array([x, y, rng.uniform(0.5, 2.0)])
            state = plate.deflect([fe.Touch(*truth.tolist())])
            exact = readings @ _free(seen.bench.plate, mesh, state.values)
            past, start = InTime(), np.empty((0, 3))
            for frame in range(STEADY_FRAMES):
                measured = exact + rng.standard_normal(len(exact))
                before = frame / rate
                both = (
                    models.estimate_in_time(ringing, estimator, seeing, measured, past, before),
                    estimator.fit_whitened(measured, start),
                )
                past, start = both[0][1], _touches(both[1])
                for k, estimate in enumerate((both[0][0], both[1])):
                    counts[k] += estimate.count != 1
                    errors[k].extend(_touches(estimate)[:1] - truth)
        place, force = (
            rms(np.array(errors[0])[:, part]) / rms(np.array(errors[1])[:, part])
            for part in (slice(0, 2), slice(2, 3))
        )
        count = len(errors[0])
        yield from line(
            "A touch that rests: followed in time over not",
            f"2 mm, {rate:g} frames/s",
            place=(place, "", at_most(1.03), count),
            force=(force, "", at_most(1.03), count),
            miscounted=(float(counts[0] - counts[1]), "frames more", NONE, count),
        )


def _free(plate: fe.Plate, mesh: fe.Mesh, values: F64) -> F64:
    """Free unknowns (N,) of a table of them."""
    from fe.linear.energy import free

    rows, columns = free(plate, mesh)
    return values[rows][:, columns].ravel()


def _touches(estimate: Estimate) -> F64:
    return np.column_stack([estimate.xy, estimate.force])


PARTS = {"one": partial(taps, 1.0), "two": partial(taps, 2.0), "steady": steady}

if __name__ == "__main__":
    run(PARTS, __doc__)

"""What the solver reaches on strains at 72 gauges.

Parts: exact, noise, count, robust, time. Times are of the processor, on one core.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

import fe
import models
from models import CandidateGrid, Estimate, Forward, gauges_inside_edges, match
from rig.report.figure import Bar, Figure, at_least, at_most
from rig.studies.study import Cell, line, rms, run, timed, times
from rig.system.arrays import F64

PLATE = fe.Plate((100.0, 100.0), 1.0, 3000.0, 0.3)
MARGIN = 10.0  # mm, between the touches and the edges
APART = 5.0  # mm
FORCE = (1.0, 10.0)  # N
INFLUENCE = fe.influence(PLATE, gauges_inside_edges(PLATE.size))
LATTICE = np.stack(np.meshgrid(*2 * [np.arange(10.0, 91.0, 5.0)]), axis=-1).reshape(-1, 2)
UNIT = float(np.sqrt(np.mean(INFLUENCE.strain(LATTICE) ** 2)))
"""Root mean square strain of a touch of 1 N."""
SCENES, HARD = 1000, 60
Touches = F64
"""x, y, mm, and force, N, of each touch, (n, 3)."""


def draw(rng: np.random.Generator, count: int) -> Touches:
    """Draw touches, `APART` mm or more from one another."""
    while True:
        places = rng.uniform(MARGIN, 100.0 - MARGIN, (count, 2))
        apart = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(count, 1)]
        if count < 2 or apart.min() >= APART:
            return np.column_stack([places, rng.uniform(*FORCE, count)])


def prepared(noise: float) -> CandidateGrid:
    """Search at a noise of `noise` times the rms strain of a touch of 1 N."""
    return models.prepare_candidates(models.gauge_forward(INFLUENCE, noise * UNIT))


def measured(forward: Forward, touches: Touches, rng: np.random.Generator | None = None) -> F64:
    """Whitened strains, with noise of 1 where a generator is given."""
    exact = forward.read(touches)[0]
    return exact if rng is None else exact + rng.normal(size=exact.shape)


def errors(estimate: Estimate, touches: Touches) -> tuple[F64, F64]:
    """Distances, mm, and force errors, N, of touches that were paired."""
    place, force, _ = match(estimate, tuple(fe.Touch(*touch) for touch in touches.tolist()))
    return place, force


def bound(forward: Forward, touches: Touches) -> F64:
    """Cramér-Rao bound of each place, mm."""
    variances = np.diag(models.covariance(forward.read(touches)[1]))
    return np.sqrt(variances[0::3] + variances[1::3])


def over_bounds(errors: list[F64], bounds: list[F64], bar: Bar | None) -> dict[str, Cell]:
    """Make cells of errors (scenes, n) mm over their own bounds, and over all of them together.

    The first weighs all scenes alike; in the second the few decide that hardly tell touches apart.
    """
    off, limits = np.array(errors), np.array(bounds)
    return {
        "RMS": (rms(off.ravel()), "mm"),
        "÷_CRB": (rms((off / limits).ravel()), "", bar, len(off)),
        "÷_CRB,_pooled": rms(off.ravel()) / rms(limits.ravel()),
    }


def exact() -> Iterator[Figure]:
    """No noise: the touches that were pressed, count unknown."""
    search = prepared(1e-8)
    for count in (1, 2, 3, 4):
        rng, worst, right = np.random.default_rng(count), 0.0, 0
        for _ in range(SCENES):
            touches = draw(rng, count)
            estimate = models.find(measured(search.forward, touches), search)
            error = max(float(np.abs(part).max()) for part in errors(estimate, touches))
            found = estimate.count == count and error <= 1e-6
            right, worst = right + found, max(worst, error if found else 0.0)
        yield from line(
            "Strain of 72 gauges: no noise",
            f"{count} touches",
            largest_error=(worst, "mm or N", at_most(1e-6)),
            right=(100 * right / SCENES, "%", at_least(99.9), SCENES),
        )


def noise() -> Iterator[Figure]:
    """Root mean square of the places ÷ CRB, and whether the covariance says so."""
    inside: list[F64] = []
    for level in (0.001, 0.01, 0.05, 0.1):
        search = prepared(level)
        for count in (1, 2, 3, 4):
            rng = np.random.default_rng(count)
            places: list[F64] = []
            limits: list[F64] = []
            while len(places) < SCENES:
                touches = draw(rng, count)
                limit = bound(search.forward, touches)
                if count > 1 and limit.max() >= 0.5:
                    continue
                estimate = models.find(measured(search.forward, touches, rng), search, count=count)
                apart = np.linalg.norm(estimate.xy[:, None] - touches[:, :2], axis=2)
                nearest = apart.argmin(axis=0)
                places.append(np.linalg.norm(estimate.xy[nearest] - touches[:, :2], axis=1))
                limits.append(limit)
                if estimate.result is models.Result.FOUND:
                    inside.append(_deviations(estimate, touches))
            yield from line(
                "Strain of 72 gauges: noise in parts of the strain of 1 N",
                f"noise {level:.1%}, {count} touches",
                **over_bounds(places, limits, at_most(1.05 if count == 1 else 1.10)),
            )
    deviations = np.abs(np.concatenate(inside))
    for sigmas, bar in ((1, Bar(65.0, 71.0)), (2, Bar(93.0, 97.0))):
        yield from line(
            "Strain of 72 gauges: stated σ, all noises together",
            f"inside {sigmas} σ",
            fraction=(100 * float(np.mean(deviations < sigmas)), "%", bar, len(deviations)),
        )


def _deviations(estimate: Estimate, touches: Touches) -> F64:
    """Errors of x, y, F of all touches over their stated standard deviations."""
    nearest = np.linalg.norm(estimate.xy[:, None] - touches[:, :2], axis=2).argmin(axis=1)
    found = np.column_stack([estimate.xy, estimate.force])
    return (found - touches[nearest]).ravel() / np.sqrt(np.diag(estimate.covariance))


def count() -> Iterator[Figure]:
    """Count from the data where every place is bounded by 1 mm."""
    for level in (0.001, 0.01, 0.05):
        search = prepared(level)
        for number in range(6):
            rng, right, tried = np.random.default_rng(number), 0, 0
            while tried < SCENES:
                touches = draw(rng, number)
                if number and bound(search.forward, touches).max() >= 1.0:
                    continue
                tried += 1
                clean = np.zeros(search.response.shape[1])
                if number:
                    clean = measured(search.forward, touches)
                noisy = clean + rng.normal(size=clean.shape)
                right += models.find(noisy, search, max_touches=6).count == number
            yield from line(
                "Strain of 72 gauges: the count from the data",
                f"noise {level:.1%}, {number} touches",
                right=(100 * right / tried, "%", at_least(99.0), tried),
            )


def robust() -> Iterator[Figure]:
    """Make a fifth of the channels false by 30 σ; leave out a side of the ring."""
    search = prepared(0.01)
    for number in (1, 2, 3):
        rng, right, counted = np.random.default_rng(number), 0, 0
        spent: list[float] = []
        for _ in range(HARD):
            touches = draw(rng, number)
            white = measured(search.forward, touches, rng)
            false = rng.permutation(white.size)[: white.size // 5]
            white[false] += 30.0 * rng.choice([-1.0, 1.0], false.size)
            estimate, spent_here = timed(partial(models.find_robust, white, search))
            spent.append(spent_here)
            counted += estimate.count == number
            right += _all_found(models.find_robust(white, search, count=number), touches)
        yield from line(
            "Strain of 72 gauges: 20 % of the channels false by 30 σ",
            f"{number} touches",
            within_1_mm=(100 * right / HARD, "%", at_least(98.0), HARD),
            count_right=(100 * counted / HARD, "%"),
            time=(float(np.median(spent)), "ms"),
        )
    lost = np.repeat(INFLUENCE.gauges[:, :1] > 94.0, 3, axis=1)
    half = models.prepare_candidates(models.gauge_forward(INFLUENCE, 0.01 * UNIT, lost))
    for number in (1, 2, 3):
        rng, right, tried = np.random.default_rng(number), 0, 0
        while tried < SCENES:
            touches = draw(rng, number)
            if bound(half.forward, touches).max() >= 0.3:
                continue
            tried += 1
            estimate = models.find(measured(half.forward, touches, rng), half, count=number)
            right += _all_found(estimate, touches)
        yield from line(
            f"Strain of 72 gauges: a side of {int(lost[:, 0].sum())} missing",
            f"{number} touches",
            within_1_mm=(100 * right / SCENES, "%", at_least(95.0), SCENES),
        )


def _all_found(estimate: Estimate, touches: Touches) -> bool:
    return estimate.count == len(touches) and bool(errors(estimate, touches)[0].max() <= 1.0)


def time() -> Iterator[Figure]:
    """Time of a frame, median over scenes."""
    search = prepared(0.01)
    for number, cold_bar, tracked_bar in ((1, 0.2, 0.03), (4, 1.0, 0.07)):
        rng = np.random.default_rng(number)
        cold: list[float] = []
        tracked: list[float] = []
        for _ in range(SCENES + 20):
            touches = draw(rng, number)
            white = measured(search.forward, touches, rng)
            start = touches + rng.normal(0, (0.3, 0.3, 0.05), touches.shape)
            cold.append(timed(partial(models.find, white, search))[1])
            tracked.append(timed(partial(models.find, white, search, start=start))[1])
        for name, taken, most in (("cold", cold, cold_bar), ("tracked", tracked, tracked_bar)):
            yield from line(
                "Strain of 72 gauges: time of a frame",
                f"{name}, {number} touches",
                **times(taken[20:], at_most(most)),
            )


PARTS = {"exact": exact, "noise": noise, "count": count, "robust": robust, "time": time}

if __name__ == "__main__":
    run(PARTS, __doc__)

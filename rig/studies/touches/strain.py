"""Print what the solver reaches on strains at 72 gauges, each figure beside its bar.

Usage: ``python benchmarks/solver_bars.py [--quick] [PART ...]``; parts are exact, noise,
count, robust and time, all of them if none is named. ``--quick`` draws a twentieth of the scenes.
Times are of the processor, on one core.
"""

import sys
from collections.abc import Iterator

import numpy as np

import fe
import models
from models.data.gauge_layout import inside_edges
from models.scores.matching import match
from rig.studies.touches.rows import Part, Row, beside, show, timed, times

PLATE = fe.Plate((100.0, 100.0), 1.0, 3000.0, 0.3)
MARGIN = 10.0  # mm, between the touches and the edges
APART = 5.0  # mm
FORCE = (1.0, 10.0)  # N
INFLUENCE = fe.influence(PLATE, inside_edges(PLATE.size))
LATTICE = np.stack(np.meshgrid(*2 * [np.arange(10.0, 91.0, 5.0)]), axis=-1).reshape(-1, 2)
UNIT = np.sqrt(np.mean(INFLUENCE.strain(LATTICE) ** 2))  # rms strain of a touch of 1 N


def draw(rng, count):
    """Touches x, y, F (count, 3), `APART` mm or more from one another."""
    while True:
        places = rng.uniform(MARGIN, 100.0 - MARGIN, (count, 2))
        apart = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(count, 1)]
        if count < 2 or apart.min() >= APART:
            return np.column_stack([places, rng.uniform(*FORCE, count)])


def prepared(noise):
    """Search at a noise of `noise` times the rms strain of a touch of 1 N."""
    return models.prepare_search(models.gauges(INFLUENCE, noise * UNIT))


def measured(forward, touches, rng=None):
    """Whitened strains, with noise of 1 where a generator is given."""
    exact = forward.read(touches)[0]
    return exact if rng is None else exact + rng.normal(size=exact.shape)


def errors(estimate, touches):
    """Distances, mm, and force errors, N, of touches that were paired."""
    place, force, _ = match(estimate, tuple(fe.Touch(*touch) for touch in touches))
    return place, force


def distances(estimate, touches):
    """Distance, mm, of each touch from the nearest that was found."""
    return np.linalg.norm(estimate.xy[:, None] - touches[:, :2], axis=2).min(axis=0)


def bound(forward, touches):
    """Cramér-Rao bound of each place, mm."""
    variances = np.diag(models.covariance(forward.read(touches)[1]))
    return np.sqrt(variances[0::3] + variances[1::3])


def exact_rows(share) -> Iterator[Row]:
    """No noise: the touches that were pressed, count unknown."""
    search, scenes = prepared(1e-8), int(1000 * share)
    for count in (1, 2, 3, 4):
        rng, worst, right = np.random.default_rng(count), 0.0, 0
        for _ in range(scenes):
            touches = draw(rng, count)
            estimate = models.find(measured(search.forward, touches), search)
            error = max(np.abs(part).max() for part in errors(estimate, touches))
            found = estimate.count == count and error <= 1e-6
            right, worst = right + found, max(worst, error if found else 0.0)
        figure = f"{worst:.1e} mm or N, {right} of {scenes}"
        yield f"no noise, {count} touches: error, found", figure, "≤ 1e-6, ≥ 99.9 %"


def noise_rows(share) -> Iterator[Row]:
    """Root mean square of the places over the bound, and whether the covariance says so."""
    scenes, inside = int(1000 * share), []
    for noise in (0.001, 0.01, 0.05, 0.1):
        search = prepared(noise)
        for count in (1, 2, 3, 4):
            rng, places, limits = np.random.default_rng(count), [], []
            while len(places) < scenes:
                touches = draw(rng, count)
                limit = bound(search.forward, touches)
                if count > 1 and limit.max() >= 0.5:
                    continue
                estimate = models.find(measured(search.forward, touches, rng), search, count=count)
                nearest = np.linalg.norm(estimate.xy[:, None] - touches[:, :2], axis=2).argmin(
                    axis=0
                )
                places.append(np.linalg.norm(estimate.xy[nearest] - touches[:, :2], axis=1))
                limits.append(limit)
                if estimate.result is models.Result.FOUND:
                    inside.append(_deviations(estimate, touches))
            bar = "≤ 1.05" if count == 1 else "≤ 1.10"
            yield f"noise {noise:.1%}, {count} touches: RMS", beside(places, limits), bar
    deviations = np.abs(np.concatenate(inside))
    for sigmas, bar in ((1, "68 ± 3 %"), (2, "95 ± 2 %")):
        yield f"stated σ: share inside {sigmas} σ", f"{np.mean(deviations < sigmas):.1%}", bar


def _deviations(estimate, touches):
    """Errors of x, y, F of all touches over their stated standard deviations."""
    nearest = np.linalg.norm(estimate.xy[:, None] - touches[:, :2], axis=2).argmin(axis=1)
    found = np.column_stack([estimate.xy, estimate.force])
    return (found - touches[nearest]).ravel() / np.sqrt(np.diag(estimate.covariance))


def count_rows(share) -> Iterator[Row]:
    """Count from the data where every place is bounded by 1 mm."""
    scenes = int(1000 * share)
    for noise in (0.001, 0.01, 0.05):
        search = prepared(noise)
        for count in range(6):
            rng, right, tried = np.random.default_rng(count), 0, 0
            while tried < scenes:
                touches = draw(rng, count)
                if count and bound(search.forward, touches).max() >= 1.0:
                    continue
                tried += 1
                exact = np.zeros(search.response.shape[1])
                if count:
                    exact = measured(search.forward, touches)
                noisy = exact + rng.normal(size=exact.shape)
                right += models.find(noisy, search, most=6).count == count
            figure = f"{right / tried:.1%} of {tried}"
            yield f"noise {noise:.1%}, {count} touches: count right", figure, "≥ 99 %"


def robust_rows(share) -> Iterator[Row]:
    """Make a fifth of the channels false by 30 σ; leave out a side of the ring."""
    scenes, gauges = int(1000 * share), len(INFLUENCE.gauges)
    search, hard = prepared(0.01), max(int(60 * share), 10)
    for count in (1, 2, 3):
        rng, right, counted, spent = np.random.default_rng(count), 0, 0, []
        for _ in range(hard):
            touches = draw(rng, count)
            white = measured(search.forward, touches, rng)
            false = rng.permutation(white.size)[: white.size // 5]
            white[false] += 30.0 * rng.choice([-1.0, 1.0], false.size)
            estimate, spent_here = timed(models.find_robust, white, search)
            spent.append(spent_here)
            counted += estimate.count == count
            right += _all_found(models.find_robust(white, search, count=count), touches)
        figure = f"{right / hard:.1%}; count {counted / hard:.1%}; {np.median(spent):.0f} ms"
        yield f"20 % false by 30 σ, {count} touches: within 1 mm", figure, "≥ 98 %"
    lost = np.repeat(INFLUENCE.gauges[:, :1] > 94.0, 3, axis=1)
    partial = models.prepare_search(models.gauges(INFLUENCE, 0.01 * UNIT, lost))
    for count in (1, 2, 3):
        rng, right, tried = np.random.default_rng(count), 0, 0
        while tried < scenes:
            touches = draw(rng, count)
            if bound(partial.forward, touches).max() >= 0.3:
                continue
            tried += 1
            estimate = models.find(measured(partial.forward, touches, rng), partial, count=count)
            right += _all_found(estimate, touches)
        figure = f"{right / scenes:.1%}, {lost[:, 0].sum()} of {gauges} gauges"
        yield f"a side missing, {count} touches: within 1 mm", figure, "≥ 95 %"


def _all_found(estimate, touches):
    return estimate.count == len(touches) and errors(estimate, touches)[0].max() <= 1.0


def time_rows(share) -> Iterator[Row]:
    """Time of a frame, median over scenes."""
    search = prepared(0.01)
    for count, cold_bar, bar in ((1, "≤ 0.2 ms", "≤ 0.05 ms"), (4, "≤ 1 ms", "≤ 0.1 ms")):
        rng, cold, tracked = np.random.default_rng(count), [], []
        for _ in range(int(1000 * share) + 20):
            touches = draw(rng, count)
            white = measured(search.forward, touches, rng)
            start = touches + rng.normal(0, (0.3, 0.3, 0.05), touches.shape)
            cold.append(timed(models.find, white, search)[1])
            tracked.append(timed(models.find, white, search, start=start)[1])
        yield f"cold frame, {count} touches", times(cold[20:]), cold_bar
        yield f"tracked frame, {count} touches", times(tracked[20:]), bar


PARTS = {
    "exact": Part("Strain of 72 gauges: no noise", exact_rows),
    "noise": Part("Strain of 72 gauges: noise in parts of the strain of 1 N", noise_rows),
    "count": Part("Strain of 72 gauges: the count from the data", count_rows),
    "robust": Part("Strain of 72 gauges: false and missing channels", robust_rows),
    "time": Part("Strain of 72 gauges: time of a frame", time_rows),
}


if __name__ == "__main__":
    show(PARTS, sys.argv[1:])

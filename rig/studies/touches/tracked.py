"""Touches over time: what a filter makes of them, beside what each frame says alone.

Parts: tracked. Places and forces are drawn about known paths with the covariance that is stated of
them, each frame by itself; errors that all frames have in common, as those of a bench, no filter
takes away. Ratios are of root mean squares, from one second after landing on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from models import Estimate, Result
from rig.live.tracks import Tracks
from rig.report.figure import Bar, Figure, at_most
from rig.studies.study import line, rms, run
from rig.system.arrays import F64

TOUCHES, SECONDS, AFTER = 24, 3.0, 1.0
RATES = (30.0, 120.0)
SIGMAS = (0.05, 0.3, 1.5)  # mm along x; 0.7 of it along y
FORCE_SIGMA = 0.03  # N
AHEAD = 0.06  # s, the way from a frame to the light of the projector
STILL, MOVING, LAG = at_most(0.35), at_most(1.0), Bar(-5.0, 5.0)

Path = Callable[[float], tuple[float, float, float]]


def _stop_and_go(t: float) -> tuple[float, float, float]:
    """Back and forth over 100 mm at 200 mm/s, with a rest of half a second at each end."""
    phase = t % 2.0
    along = min(phase, 0.5) if phase < 1.0 else max(1.5 - phase, 0.0)
    return 60.0 + 200.0 * along, 90.0, 2.0


PATHS: dict[str, tuple[Path, Bar | None]] = {
    "still": (lambda t: (100.0, 90.0, 2.0), STILL),
    "200 mm/s, straight": (lambda t: (20.0 + 160.0 * t, 400.0 - 120.0 * t, 2.0), MOVING),
    "200 mm/s, circle of 40 mm": (
        lambda t: (100.0 + 40.0 * np.cos(5.0 * t), 90.0 + 40.0 * np.sin(5.0 * t), 2.0),
        MOVING,
    ),
    "200 mm/s, stop and go": (_stop_and_go, MOVING),
    "20 mm/s, straight": (lambda t: (20.0 + 20.0 * t, 90.0, 2.0), None),
    "2 mm/s, straight": (lambda t: (20.0 + 2.0 * t, 90.0, 2.0), None),
    "still, force 2 ± 1.5 N at 6 Hz": (
        lambda t: (100.0, 90.0, 2.0 + 1.5 * np.sin(12.0 * np.pi * t)),
        None,
    ),
}


class Errors(NamedTuple):
    """Errors of K frames, (K, 3) of x, y in mm and F in N; `ahead` of x and y, (K, 2).

    `broken` counts touches that got another name on their way.
    """

    broken: int
    alone: F64
    filtered: F64
    sigma: F64
    ahead: F64
    speed: F64


def follow(path: Path, rate: float, sigma: float, seed: int) -> Errors:
    """Follow some touches along a path."""
    rng, spread = np.random.default_rng(seed), np.square([sigma, 0.7 * sigma, FORCE_SIGMA])
    rows: list[tuple[F64, ...]] = []
    broken = 0
    for _ in range(TOUCHES):
        tracks, named = Tracks(), set[int]()
        for k in range(round(SECONDS * rate)):
            time = k / rate
            truth = np.array(path(time))
            seen = truth + np.sqrt(spread) * rng.standard_normal(3)
            estimate = Estimate(
                seen[None, :2], seen[2:], np.diag(spread), 1.0, 1, 0.5, Result.FOUND
            )
            tracks, (name,), _ = tracks.follow(estimate, time)
            named.add(name)
            if time < AFTER:
                continue
            track = next(one for one in tracks.tracks if one.identity == name)
            found, covariance = track.seen
            later = track.at(time + AHEAD)[0][:2] - path(time + AHEAD)[:2]
            pace = (np.array(path(time)) - path(time - 1 / rate))[:2] * rate
            deviation = np.sqrt(np.diag(covariance))
            rows.append((seen - truth, found - truth, deviation, later, pace))
        broken += len(named) - 1
    return Errors(broken, *(np.array(part) for part in zip(*rows, strict=True)))


def tracked() -> Iterator[Figure]:
    """Compare the filter with single frames."""
    worst: dict[Bar, list[float]] = {STILL: [], MOVING: [], LAG: []}
    for name, (path, bar) in PATHS.items():
        for rate in RATES:
            for sigma in SIGMAS:
                found = follow(path, rate, sigma, seed=4)
                count = len(found.alone)
                ratio = rms(found.filtered[:, :2]) / rms(found.alone[:, :2])
                squared = np.sum(found.speed**2)
                lag = -1e3 * np.sum(found.speed * found.filtered[:, :2]) / max(squared, 1e-9)
                moving = squared > 0
                if bar:
                    worst[bar].append(float(ratio))
                if bar and moving:
                    worst[LAG].append(float(lag))
                yield from line(
                    "Touches over time: the filter over one frame alone",
                    f"{name}, {rate:g} frames/s, σ {sigma:g} mm",
                    place=(float(ratio), "of one frame's", bar, count),
                    lag=(
                        float(lag) if moving else None,
                        "ms",
                        LAG if bar and moving else None,
                        count,
                    ),
                    force=(
                        rms(found.filtered[:, 2]) / rms(found.alone[:, 2]),
                        "of one frame's",
                        None,
                        count,
                    ),
                    error_over_σ=(rms((found.filtered / found.sigma)[:, :2]), "", None, count),
                    other_names=(float(found.broken), "", None, TOUCHES),
                    place_60_ms_ahead=(rms(found.ahead), "mm", None, count),
                )
    yield from _summed(worst)


def _summed(worst: dict[Bar, list[float]]) -> Iterator[Figure]:
    """Give the worst of all paths, rates and scatters that have a bar."""
    table = "Touches over time: the worst of all"
    still, moving, lag = worst[STILL], worst[MOVING], worst[LAG]
    yield from line(table, "still touch after 1 s over one frame", error=(max(still), "", STILL))
    yield from line(table, "moving touch over one frame", error=(max(moving), "", MOVING))
    yield from line(table, "moving touch", lag=(max(lag, key=abs), "ms", LAG))


PARTS = {"tracked": tracked}

if __name__ == "__main__":
    run(PARTS, __doc__)

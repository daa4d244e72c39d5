"""Scores of estimates against the truth: errors of matched touches, misses, false touches, honesty.

An estimate says how sure it is; that is scored with it: of errors in units of their stated standard
deviation 68.3, 95.4 and 99.7 % lie inside 1, 2 and 3 where it is right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from models.arrays import F64, Mask
from models.estimate import Estimate
from models.scores.matching import pair

BANDS = 3  # of the force, evenly in its logarithm


@dataclass(frozen=True)
class TouchScore:
    """Figures of some touches; None where nothing was found.

    Attributes
    ----------
    force : (float, float), N
        Least and largest true one.
    touches, misses, false : int
        True ones, those of them that were not found, and those found that are not there.
    mean, p50, p95, max, rms : float, mm
        Distance of matched touches.
    bound : float, mm
        Root mean square that no unbiased estimate goes below; None where it is not known.
    force_error : float, N
        Mean absolute difference.
    inside : (float, float, float)
        Fractions of the errors of x, y and F inside 1, 2 and 3 stated standard deviations.
    """

    force: tuple[float, float]
    touches: int
    misses: int
    false: int
    mean: float | None
    p50: float | None
    p95: float | None
    max: float | None
    rms: float | None
    bound: float | None
    force_error: float | None
    inside: tuple[float, float, float] | None


@dataclass(frozen=True, eq=False)
class TouchPairs:
    """True touches, and what was reported of each.

    Attributes
    ----------
    truth : (N, 3) float64, mm, mm, N
    error : (N, 3) float64, mm, mm, N
        Reported less true; NaN for a touch that was not found.
    sigma : (N, 3) float64, mm, mm, N
        As stated.
    false : int
        Touches that were reported and not there.
    """

    truth: F64
    error: F64
    sigma: F64
    false: int

    @property
    def distance(self) -> F64:
        """How far each is off, (N,) mm."""
        return np.hypot(self.error[:, 0], self.error[:, 1])


def pair_touches(reported: Sequence[Estimate], truth: Sequence[ArrayLike]) -> TouchPairs:
    """Pair what was reported with what was there, sample by sample, at least sum of distances.

    Parameters
    ----------
    reported
        N estimates.
    truth
        (k, 3) of each: x, y, F of the touches that were there, k = 0 for none.

    Raises
    ------
    ValueError
        When there is not one truth an estimate.
    """
    if len(reported) != len(truth):
        raise ValueError(
            f"every estimate needs its truth, got {len(reported)} and {len(truth)}; give as many"
        )
    there = [np.asarray(each, dtype=np.float64).reshape(-1, 3) for each in truth]
    rows = [_pair(one, touches) for one, touches in zip(reported, there, strict=True)]
    false = sum(max(0, one.count - len(each)) for one, each in zip(reported, there, strict=True))
    every = np.concatenate([np.empty((0, 3, 3)), *rows])
    return TouchPairs(every[:, 0], every[:, 1], every[:, 2], false)


def score_touches(
    pairs: TouchPairs, bound: F64 | None = None
) -> tuple[TouchScore, list[TouchScore]]:
    """Return the score of all touches, and that of each band of forces where these differ.

    Parameters
    ----------
    pairs
    bound : (N,) float64, mm²
        Least variance of the place of each true touch.
    """
    force = pairs.truth[:, 2]
    total = _score(pairs, np.ones(len(force), dtype=bool), bound, pairs.false)
    if not len(force) or force.max() <= force.min() * (1.0 + 1e-9):
        return total, []
    edges: F64 = np.geomspace(float(force.min()), float(force.max()), BANDS + 1)
    band = np.clip(np.searchsorted(edges, force, side="right") - 1, 0, BANDS - 1)
    bands = [_score(pairs, band == number, bound, 0) for number in np.unique(band)]
    return total, bands


def _pair(reported: Estimate, truth: F64) -> F64:
    """Truth, error and σ of each true touch, (k, 3, 3)."""
    found = np.full((len(truth), 3, 3), np.nan)
    found[:, 0] = truth
    for here, true in zip(*pair(reported.xy, truth[:, :2]), strict=True):
        found[true, 1] = np.array([*reported.xy[here], reported.force[here]]) - truth[true]
        found[true, 2] = np.sqrt(np.diag(reported.touch_covariance(here)))
    return found


def _score(pairs: TouchPairs, chosen: Mask, bound: F64 | None, false: int) -> TouchScore:
    force, distance = pairs.truth[chosen, 2], pairs.distance[chosen]
    found = np.isfinite(distance)
    extent = (float(force.min()), float(force.max())) if len(force) else (0.0, 0.0)
    count, misses = len(force), int(np.count_nonzero(~found))
    if not found.any():
        none = (None,) * 8
        return TouchScore(extent, count, misses, false, *none)
    off, error = distance[found], pairs.error[chosen][found]
    deviations = np.abs(error) / pairs.sigma[chosen][found]
    expected = None if bound is None else float(np.sqrt(bound[chosen][found].mean()))
    one, two, three = (float((deviations < number).mean()) for number in (1, 2, 3))
    median, late = (float(each) for each in np.percentile(off, [50, 95]))
    return TouchScore(
        force=extent,
        touches=count,
        misses=misses,
        false=false,
        mean=float(off.mean()),
        p50=median,
        p95=late,
        max=float(off.max()),
        rms=float(np.sqrt(np.mean(off**2))),
        bound=expected,
        force_error=float(np.abs(error[:, 2]).mean()),
        inside=(one, two, three),
    )

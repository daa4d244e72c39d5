"""Touches from a measurement: least squares on a forward model, forces free, count from the data.

Touches are added one by one, each where it explains most of what is left, as long as χ² falls by
more than chance allows. Greed can end beside the best fit: what does not explain the measurement is
looked for again, pair by pair, and a fit that followed the last frame is then begun afresh.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtrc

import fe
from models.descent import chi2, covariance, descend, predict
from models.estimate import Estimate, Result
from models.forward import gauges
from models.search import Search, prepare_search

# Fall of χ² that a touch must bring. Noise alone brought 19 at most in 3000 measurements; rendered
# frames, whose model is right to half a percent, 22 in 200.
GAIN = 25.0
CLEAR = 10.0  # times `GAIN`: no doubt that a touch is there
UNUSUAL = 6.0  # standard deviations of χ² above its mean: the fit does not explain the measurement


def solve(
    strain: NDArray,
    influence: fe.Influence,
    sigma: ArrayLike,
    count: int | None = None,
    most: int = 4,
) -> Estimate:
    """Find touches from strain at gauges.

    Parameters
    ----------
    strain : (M, 3) float64, strain
        exx, eyy, exy at the gauges of `influence`; not finite for a channel that is missing.
    influence : fe.Influence
    sigma : float, (M,) or (M, 3), strain
        Standard deviation of each channel.
    count : int, optional
        Number of touches where it is known; found from the data otherwise.
    most : int
        Largest number of touches looked for.

    Raises
    ------
    ValueError
        If strain or sigma do not fit the gauges, nothing is measured, or a count is negative.
    """
    strain = np.asarray(strain, dtype=np.float64)
    expected = (len(influence.gauges), 3)
    if strain.shape != expected:
        raise ValueError(
            f"strain must have shape {expected}, exx, eyy, exy of each gauge, got {strain.shape}"
        )
    forward = gauges(influence, sigma, missing=~np.isfinite(strain))
    return find(forward.whiten(strain), prepare_search(forward), count=count, most=most)


def find(
    measured: NDArray,
    search: Search,
    *,
    start: ArrayLike = (),
    count: int | None = None,
    most: int = 4,
) -> Estimate:
    """Find touches from a whitened measurement.

    Parameters
    ----------
    measured : (m,) float64
        In units of its noise.
    search : Search
        Forward model with its candidates.
    start : (n, 3) array, mm, mm, N
        x, y, F of the last frame's touches, where there are any: the fit begins there.
    count : int, optional
        Number of touches where it is known.
    most : int
        Largest number of touches looked for.

    Returns
    -------
    Estimate
        UNRESOLVABLE where fewer touches than found or asked for explain the measurement as well.

    Raises
    ------
    ValueError
        If the measurement does not fit the forward model or is not finite, or a count is negative.
    """
    limit = most if count is None else count
    _check(measured, search, limit)
    begun = np.array(start, dtype=np.float64).reshape(-1, 3)[:limit]
    touches = _follow(measured, search, begun, limit, count)
    usual = len(touches) == len(begun) and _explains(measured, search, touches)
    if len(begun) and not usual:
        afresh = _follow(measured, search, begun[:0], limit, count)
        touches = min(touches, afresh, key=lambda found: _cost(measured, search, found))
    needed = _without_idle(measured, search, touches)
    if count is None:
        touches = needed
    return _describe(measured, search, touches, len(needed) == (count or len(touches)))


def _check(measured: NDArray, search: Search, limit: int) -> None:
    expected = (search.response.shape[1],)
    if measured.shape != expected:
        raise ValueError(
            f"measurement must have shape {expected} as the forward model, got {measured.shape}"
        )
    if not np.isfinite(measured).all():
        raise ValueError("measurement holds NaN or infinite values; leave missing channels out")
    if limit < 0:
        raise ValueError(f"number of touches must be 0 or more, got {limit}; use 1")


def _fit(measured: NDArray, search: Search, touches: NDArray) -> NDArray[np.float64]:
    return descend(measured, search.forward, touches, search.bounds) if len(touches) else touches


def _freedom(measured: NDArray, touches: NDArray) -> int:
    return max(len(measured) - 3 * len(touches), 1)


def _explains(measured: NDArray, search: Search, touches: NDArray) -> bool:
    """Whether touches leave no more than noise; else the fit may be a local minimum."""
    dof = _freedom(measured, touches)
    return chi2(measured, search.forward, touches) < dof + UNUSUAL * np.sqrt(2.0 * dof)


def _cost(measured: NDArray, search: Search, touches: NDArray) -> float:
    """χ², and `GAIN` for every touch, which must earn its place."""
    return chi2(measured, search.forward, touches) + GAIN * len(touches)


def _follow(
    measured: NDArray, search: Search, begun: NDArray, limit: int, count: int | None
) -> NDArray[np.float64]:
    """Fit the touches begun with, drop those that idle, and add those that are missing."""
    touches = begun.copy()
    touches[:, :2] = np.clip(touches[:, :2], *search.bounds)
    touches = _fit(measured, search, touches)
    if count is None:
        touches = _without_idle(measured, search, touches)
    grown = _grow(measured, search, touches, limit, GAIN if count is None else 0.0)
    return grown if grown is touches else _pairs_anew(measured, search, grown)


def _grow(
    measured: NDArray, search: Search, touches: NDArray, limit: int, least: float
) -> NDArray[np.float64]:
    """Add touches one by one up to `limit`, as long as each lets χ² fall by more than `least`."""
    while len(touches) < limit:
        grown = _one_more(measured, search, touches, least)
        if grown is None:
            break
        touches = grown
    return touches


def _one_more(
    measured: NDArray, search: Search, touches: NDArray, least: float
) -> NDArray[np.float64] | None:
    """One touch more, where it explains most of what is left; None if χ² falls by `least` or less.

    A candidate of the grid that promises less than half of that is not worth a fit: between the
    candidates a touch is worth little more than on the best of them.
    """
    predicted, tangent = predict(search.forward, touches)
    residual = measured - predicted
    index, gain = search.best(residual, tangent)
    if gain <= 0.5 * least:
        return None
    response = search.response[index]
    force = max(residual @ response / (response @ response), 0.0)
    grown = _fit(measured, search, np.vstack([touches, [*search.xy[index], force]]))
    fall = residual @ residual - chi2(measured, search.forward, grown)
    return grown if fall > least else None


def _pairs_anew(measured: NDArray, search: Search, touches: NDArray) -> NDArray[np.float64]:
    """Look for each pair of touches again among all pairs of candidates, until all is explained.

    Twice, since a pair that moved makes way for others.
    """
    for pair in 2 * list(combinations(range(len(touches)), 2)):
        if _explains(measured, search, touches):
            break
        others = np.delete(touches, pair, axis=0)
        predicted, tangent = predict(search.forward, others)
        places, force = search.best_pair(measured - predicted, tangent)
        again = np.vstack([others, np.column_stack([search.xy[places], force])])
        again = _fit(measured, search, again)
        touches = min(touches, again, key=lambda found: chi2(measured, search.forward, found))
    return touches


def _without_idle(measured: NDArray, search: Search, touches: NDArray) -> NDArray[np.float64]:
    """Drop, weakest first, the touches without which χ² rises by less than `GAIN`.

    A touch whose force stands far out of its own noise needs no second fit to be kept.
    """
    while len(touches):
        variances = np.diag(covariance(search.forward, touches))[2::3]
        evidence = touches[:, 2] ** 2 / variances
        weakest = int(np.argmin(evidence))
        if evidence[weakest] > CLEAR * GAIN:
            break
        fewer = _fit(measured, search, np.delete(touches, weakest, axis=0))
        rise = chi2(measured, search.forward, fewer) - chi2(measured, search.forward, touches)
        if rise >= GAIN:
            break
        touches = fewer
    return touches


def _describe(measured: NDArray, search: Search, touches: NDArray, needed: bool) -> Estimate:
    touches = touches[np.lexsort((touches[:, 1], touches[:, 0]))]
    left = chi2(measured, search.forward, touches)
    dof = _freedom(measured, touches)
    spread = covariance(search.forward, touches)
    return Estimate(
        xy=touches[:, :2],
        force=touches[:, 2],
        covariance=spread,
        chi2=left,
        dof=dof,
        p_value=float(chdtrc(dof, left)),
        result=_judge(touches, spread, needed),
    )


def _judge(touches: NDArray, covariance: NDArray, needed: bool) -> Result:
    if not len(touches):
        return Result.NO_TOUCH
    pairs = combinations(range(len(touches)), 2)
    if needed and all(_apart(touches, covariance, *pair) for pair in pairs):
        return Result.FOUND
    return Result.UNRESOLVABLE


def _apart(touches: NDArray, covariance: NDArray, i: int, j: int) -> bool:
    """Whether the places of two touches differ by three standard deviations or more."""
    a, b = slice(3 * i, 3 * i + 2), slice(3 * j, 3 * j + 2)
    between = touches[i, :2] - touches[j, :2]
    spread = covariance[a, a] + covariance[b, b] - covariance[a, b] - covariance[b, a]
    return bool(between @ np.linalg.solve(spread, between) >= 9.0)

"""Touches from a measurement: least squares on a forward model, forces free, count from the data.

Touches are added one by one, each where it explains most of what is left, as long as χ² falls by
more than chance allows. Greed can end beside the best fit: what does not explain the measurement is
looked for again, pair by pair, and a fit that followed the last frame is then begun afresh.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtrc

import fe
from models.descent import Fit, covariance, descend, least_apart
from models.estimate import Estimate, Result
from models.knowledge import FLAT, Prior
from models.search import Search, prepare_search
from models.strain_gauges import gauges

# Fall of χ² that a touch must bring. Noise alone brought 19 at most in 3000 measurements; rendered
# frames, whose model is right to half a percent, 22 in 200.
GAIN = 25.0
CLEAR = 10.0  # times `GAIN`: no doubt that a touch is there
APART = 3.0  # standard deviations between two places that are told apart
UNUSUAL = 6.0  # standard deviations of χ² above its mean: the fit does not explain the measurement


def solve(
    strain: NDArray,
    influence: fe.Influence,
    sigma: ArrayLike | None = None,
    count: int | None = None,
    most: int = 4,
    covariance: ArrayLike | None = None,
    prior: Prior = FLAT,
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
    covariance : (M, 3, 3) or (3M, 3M), strain²
        Instead of sigma, where the noise of channels is correlated.
    prior : Prior
        What is known of every touch beforehand.

    Raises
    ------
    ValueError
        If strain, sigma or covariance do not fit the gauges, nothing is measured, or a count is
        negative.
    """
    strain = np.asarray(strain, dtype=np.float64)
    expected = (len(influence.gauges), 3)
    if strain.shape != expected:
        raise ValueError(
            f"strain must have shape {expected}, exx, eyy, exy of each gauge, got {strain.shape}"
        )
    forward = gauges(influence, sigma, ~np.isfinite(strain), covariance)
    search = prepare_search(forward)
    return find(forward.whiten(strain), search, count=count, most=most, prior=prior)


def find(
    measured: NDArray,
    search: Search,
    *,
    start: ArrayLike = (),
    count: int | None = None,
    most: int = 4,
    prior: Prior = FLAT,
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
    prior : Prior
        What is known of every touch beforehand.

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
    task = _Task(measured, search, prior, limit, 0.0 if count is not None else GAIN)
    begun = np.array(start, dtype=np.float64).reshape(-1, 3)[:limit]
    fit = _follow(task, begun)
    if len(begun) and not (len(fit.touches) == len(begun) and task.explained(fit)):
        fit = min(fit, _follow(task, begun[:0]), key=_cost)
    needed = _without_idle(task, fit)
    return _describe(task, needed if count is None else fit, len(needed.touches))


@dataclass(frozen=True, eq=False)
class _Task:
    """What is to be explained, by what, and how much a touch must bring to count."""

    measured: NDArray[np.float64]
    search: Search
    prior: Prior
    limit: int
    least: float

    def fit(self, touches: NDArray) -> Fit:
        """Touches of least χ² downhill of some."""
        if not len(touches):
            chi2 = float(self.measured @ self.measured)
            return Fit(touches, self.measured, np.empty((0, len(self.measured))), chi2)
        return descend(self.measured, self.search.forward, touches, self.search.bounds, self.prior)

    def freedom(self, fit: Fit) -> int:
        unknowns = (3 - self.prior.known) * len(fit.touches)
        return max(self.search.forward.freedom - unknowns, 1)

    def explained(self, fit: Fit) -> bool:
        """Whether touches leave no more than noise; else the fit may be a local minimum."""
        freedom = self.freedom(fit)
        if fit.chi2 > freedom + UNUSUAL * np.sqrt(2.0 * freedom):
            return False
        return self.search.best(fit.residual, fit.jacobian)[1] < GAIN


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


def _cost(fit: Fit) -> float:
    """χ², and `GAIN` for every touch, which must earn its place."""
    return fit.chi2 + GAIN * len(fit.touches)


def _follow(task: _Task, begun: NDArray) -> Fit:
    """Fit the touches begun with, drop those that idle, and add those that are missing."""
    fit = task.fit(begun)
    if task.least > 0:
        fit = _without_idle(task, fit)
    grown = _grow(task, fit)
    if grown is fit or task.explained(grown):
        return grown
    return min(grown, _grow(task, fit, _pairs_anew), key=_cost)


def _grow(task: _Task, fit: Fit, mend: Callable[[_Task, Fit], Fit] = lambda task, fit: fit) -> Fit:
    """Add touches one by one, mending all after each, while χ² falls by more than it must."""
    while len(fit.touches) < task.limit:
        grown = _one_more(task, fit)
        if grown is None:
            break
        fit = mend(task, grown)
    return fit


def _one_more(task: _Task, fit: Fit) -> Fit | None:
    """One touch more, where it explains most of what is left; None if χ² falls by too little.

    A candidate of the grid that promises less than half of that is not worth a fit: between the
    candidates a touch is worth little more than on the best of them.
    """
    index, gain = task.search.best(fit.residual, fit.jacobian)
    if gain <= 0.5 * task.least:
        return None
    response = task.search.response[index]
    force = max(fit.residual @ response / (response @ response), 0.0)
    grown = task.fit(np.vstack([fit.touches, [*task.search.xy[index], force]]))
    return grown if fit.chi2 - grown.chi2 > task.least else None


def _pairs_anew(task: _Task, fit: Fit) -> Fit:
    """Look for each pair of touches again among all pairs of candidates, until all is explained.

    Twice, since a pair that moved makes way for others.
    """
    for pair in 2 * list(combinations(range(len(fit.touches)), 2)):
        if task.explained(fit):
            break
        others = np.delete(fit.touches, pair, axis=0)
        predicted, tangent = task.search.forward.read(others)
        places, force = task.search.best_pair(task.measured - predicted, tangent)
        again = np.vstack([others, np.column_stack([task.search.xy[places], force])])
        fit = min(fit, task.fit(again), key=_cost)
    return fit


def _without_idle(task: _Task, fit: Fit) -> Fit:
    """Leave out touches, one by one, without which χ² rises by less than `GAIN`."""
    while len(fit.touches):
        spread = covariance(fit.jacobian, task.prior.precision)
        tried = [task.fit(fewer) for fewer in _with_one_less(fit.touches, spread)]
        fewer = min(tried, key=_cost, default=fit)
        if _cost(fewer) >= _cost(fit):
            break
        fit = fewer
    return fit


def _with_one_less(touches: NDArray, spread: NDArray) -> Iterator[NDArray[np.float64]]:
    """Touches without the weakest, or with the two merged that are least apart.

    A touch whose force stands far out of its own noise, and two that stand well apart, need no
    second fit to be kept.
    """
    evidence = touches[:, 2] ** 2 / np.diag(spread)[2::3]
    weakest = int(np.argmin(evidence))
    if evidence[weakest] <= CLEAR * GAIN:
        yield np.delete(touches, weakest, axis=0)
    i, j, apart = least_apart(touches, spread)
    if apart <= CLEAR * GAIN:
        merged = np.delete(touches, j, axis=0)
        force = touches[i, 2] + touches[j, 2]
        if force > 0:
            merged[i] = (touches[i] * touches[i, 2] + touches[j] * touches[j, 2]) / force
        merged[i, 2] = force
        yield merged


def _describe(task: _Task, fit: Fit, needed: int) -> Estimate:
    order = np.lexsort((fit.touches[:, 1], fit.touches[:, 0]))
    touches = fit.touches[order]
    rows = (3 * order[:, None] + np.arange(3)).ravel()
    spread = covariance(fit.jacobian, task.prior.precision)[np.ix_(rows, rows)]
    freedom = task.freedom(fit)
    return Estimate(
        xy=touches[:, :2],
        force=touches[:, 2],
        covariance=spread,
        chi2=fit.chi2,
        dof=freedom,
        p_value=float(chdtrc(freedom, fit.chi2)),
        result=_judge(touches, spread, needed == len(touches)),
    )


def _judge(touches: NDArray, spread: NDArray, needed: bool) -> Result:
    if not len(touches):
        return Result.NO_TOUCH
    if needed and least_apart(touches, spread)[2] >= APART**2:
        return Result.FOUND
    return Result.UNRESOLVABLE

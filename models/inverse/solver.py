"""Touches from a measurement: least squares on a forward model, forces free, count found."""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtrc

import fe
from models.estimate import Estimate, Result
from models.forward.gauges import gauge_forward
from models.inverse.candidates import CandidateGrid, prepare_candidates
from models.inverse.greedy import CountProblem, pruned, search_count
from models.inverse.levenberg_marquardt import Fit, sort_touches, weak_or_close
from models.inverse.prior import FLAT, Prior

APART = 3.0  # standard deviations between two places that are told apart
# Standard deviations by which the force of a touch is known to be one. Below it χ² is no parabola:
# where only force and place together are known, errors exceeded 5 of those stated in 2 to 5 %.
SURE = 6.0


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
    forward = gauge_forward(influence, sigma, ~np.isfinite(strain), covariance)
    search = prepare_candidates(forward)
    return find(forward.whiten(strain), search, count=count, most=most, prior=prior)


def find(
    measured: NDArray,
    search: CandidateGrid,
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
    search : CandidateGrid
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
        UNRESOLVABLE where fewer touches than found or asked for explain the measurement as well,
        where the covariance promises too much (a touch is held back by the edge of the plate, or
        its force is hardly known to be one), and where the fit did not settle.

    Raises
    ------
    ValueError
        If the measurement does not fit the forward model, it or the start is not finite, the start
        is not x, y, F of touches, or a count is negative.
    """
    limit = most if count is None else count
    check_measured(measured, search, limit)
    task = CountProblem(measured, search, prior, limit, count is not None)
    begun = _begun(start)[:limit]
    fit = task.fit(begun)
    if not len(begun) or not task.explained(fit):
        fit = search_count(task, fit)
    needed = pruned(task, fit)
    idle = len(fit.touches) - len(needed.touches)
    if count is None or not idle:
        return _describe(task, needed, needed=True)
    return _describe(task, fit, needed=False)


def check_measured(measured: NDArray, search: CandidateGrid, limit: int) -> None:
    """Refuse a measurement that does not fit its forward model; see `find`."""
    expected = (search.response.shape[1],)
    if measured.shape != expected:
        raise ValueError(
            f"measurement must have shape {expected} as the forward model, got {measured.shape}"
        )
    if not isfinite(measured @ measured):  # a third of the time of looking at each
        raise ValueError("measurement holds NaN or infinite values; leave missing channels out")
    if limit < 0:
        raise ValueError(f"number of touches must be 0 or more, got {limit}; use 1")


def _begun(start: ArrayLike) -> NDArray[np.float64]:
    """Touches (n, 3) to start from."""
    touches = np.array(start, dtype=np.float64)
    if touches.size and (touches.ndim > 2 or touches.shape[-1] != 3):
        raise ValueError(
            f"start must be (n, 3), x, y, F of each touch, got shape {touches.shape}; "
            "give one row a touch"
        )
    if not isfinite(np.vdot(touches, touches)):
        raise ValueError("start holds NaN or infinite values; leave such a touch out")
    return touches.reshape(-1, 3)


def _describe(task: CountProblem, fit: Fit, *, needed: bool) -> Estimate:
    touches, spread = sort_touches(fit.touches, fit.spread)
    freedom = task.freedom(fit)
    sound = needed and fit.settled and task.search.within(touches)
    return Estimate(
        xy=touches[:, :2],
        force=touches[:, 2],
        covariance=spread,
        chi2=fit.chi2,
        dof=freedom,
        p_value=float(chdtrc(freedom, fit.chi2)),
        result=_judge(touches, spread, sound),
    )


def _judge(touches: NDArray, spread: NDArray, sound: bool) -> Result:
    if not len(touches):
        return Result.NO_TOUCH
    _, evidence, _, _, apart = weak_or_close(touches, spread)
    if sound and evidence >= SURE**2 and apart >= APART**2:
        return Result.FOUND
    return Result.UNRESOLVABLE

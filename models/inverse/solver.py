"""Touches from a measurement: least squares on a forward model, forces free, count found."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc

from models.arrays import F64
from models.checks import check_integer, read_array
from models.estimate import Estimate, Result, SolverStats
from models.forward.linear import Forward
from models.inverse.candidates import CandidateGrid
from models.inverse.descent_kernel import sort_touches, weak_or_close
from models.inverse.greedy import CountProblem, pruned, search_count
from models.inverse.levenberg_marquardt import Fit, LevenbergMarquardt
from models.inverse.prior import FLAT, Prior
from models.inverse.tracked import Tracked, track

APART = 3.0  # standard deviations between the places of two touches that are two
# Standard deviations by which the force of a touch is known to be one. Below it χ² is no parabola:
# where only force and place together are known, errors exceeded 5 of those stated in 2 to 5 %.
SURE = 6.0

# Fall of χ² below which a fit on a model that errs by more has converged. A last step that promises
# so little, a tenth of a standard deviation, is taken and leaves about its square.
SETTLED = 0.01

# Errors of a forward model look like touches more than noise does. They are of second order, so
# that each of n touches has a part with every other one: in variance they move touches by n² times
# this more than errors that are even. `rig.studies.touches.missed` finds it on reduced plates.
ALIKE = 1.3

WHITEN = "whiten it by the same model"
STANDARD = LevenbergMarquardt()


def find(
    measured: F64,
    candidates: CandidateGrid,
    *,
    start: ArrayLike = (),
    count: int | None = None,
    max_touches: int = 4,
    prior: Prior = FLAT,
    solver: LevenbergMarquardt = STANDARD,
) -> Estimate:
    """Find touches from a whitened measurement.

    Parameters
    ----------
    measured : (m,) float64
        In units of its noise.
    candidates : CandidateGrid
        Of the forward model.
    start : (n, 3) array, mm, mm, N
        x, y, F of the last frame's touches, where there are any: the fit begins there.
    count : int, optional
        Number of touches where it is known.
    max_touches : int
        Largest number of touches looked for.
    prior : Prior
        What is known of every touch beforehand.
    solver : LevenbergMarquardt

    Returns
    -------
    Estimate
        UNRESOLVABLE where fewer touches than found or asked for explain the measurement as well,
        where the covariance promises too much (a touch is held back by the edge of the plate, or
        its force is hardly known to be one), and where the fit did not converge.

    Raises
    ------
    ValueError
        If the measurement does not fit the forward model, it or the start is not finite, the start
        is not x, y, F of touches, or a count is negative.
    """
    limit = touch_limit(count, max_touches)
    measured = check_measured(measured, candidates)
    if candidates.forward.model_error:
        solver = replace(solver, tolerance=max(solver.tolerance, SETTLED))
    begun = read_start(start)[:limit]
    tracked = track(measured, candidates, begun, prior, solver)
    if tracked is not None:
        return _as_tracked(tracked)
    problem = CountProblem(measured, candidates, prior, solver, limit, count is not None)
    fit = problem.fit(begun)
    if not len(begun) or not problem.explained(fit):
        fit = search_count(problem, fit)
    needed = pruned(problem, fit)
    idle = len(fit.touches) - len(needed.touches)
    if count is None or not idle:
        return _describe(problem, needed, needed=True)
    return _describe(problem, fit, needed=False)


def touch_limit(count: int | None, max_touches: int) -> int:
    """Return how many touches there can be: as many as are known, or the largest number."""
    if count is None:
        return check_integer("max_touches", max_touches, 0, "use 4")
    return check_integer("number of touches", count, 0, "use 1")


def check_measured(measured: F64, candidates: CandidateGrid) -> F64:
    """Refuse a measurement that does not fit its forward model; see `find`."""
    size = candidates.response.shape[1]
    if type(measured) is not np.ndarray or measured.dtype != np.float64 or measured.ndim != 1:
        measured = read_array("measurement", measured, "as the forward model", (size,), WHITEN)
    if len(measured) != size:
        raise ValueError(
            f"measurement must have shape {(size,)} as the forward model, got {measured.shape}; "
            f"{WHITEN}"
        )
    if not isfinite(np.vdot(measured, measured)):  # a third of the time of looking at each
        raise ValueError("measurement holds NaN or infinite values; leave missing channels out")
    return measured


def read_start(start: ArrayLike) -> F64:
    """Return touches (n, 3) to start from; see `find`."""
    touches = _as_numbers(start)
    if touches.size and (touches.ndim not in (1, 2) or touches.shape[-1] != 3):
        raise ValueError(
            f"start must be (n, 3), x, y, F of each touch, got shape {touches.shape}; "
            "give one row a touch"
        )
    if not isfinite(np.vdot(touches, touches)):
        raise ValueError("start holds NaN or infinite values; leave such a touch out")
    return touches.reshape(-1, 3)


def _as_numbers(start: ArrayLike) -> F64:
    """Read a start of any shape."""
    try:
        given = np.asarray(start)
    except (TypeError, ValueError):
        raise ValueError("start must be (n, 3), x, y, F of each touch; give equal rows") from None
    if given.dtype.kind not in "fiu":
        raise ValueError(
            f"start must be (n, 3) numbers, x, y, F of each touch, got {given.dtype}; use floats"
        )
    return np.array(given, dtype=np.float64)


def _as_tracked(tracked: Tracked) -> Estimate:
    """State touches of which nothing is left to be searched for."""
    touches, freedom = tracked.touches, tracked.freedom
    sure = tracked.evidence >= SURE**2 and tracked.apart >= APART**2
    sound = tracked.converged and tracked.within
    return Estimate(
        touches[:, :2],
        touches[:, 2],
        tracked.covariance,
        tracked.chi2,
        freedom,
        float(chdtrc(freedom, tracked.chi2)),
        Result.FOUND if sound and sure else Result.UNRESOLVABLE,
        SolverStats(1, tracked.steps, tracked.evaluations, tracked.converged),
    )


def _describe(problem: CountProblem, fit: Fit, *, needed: bool) -> Estimate:
    forward = problem.candidates.forward
    added = added_variance(forward, fit.touches, fit.residual.size)
    wider = widening(fit.touches, added)
    touches, spread = sort_touches(fit.touches, wider * fit.covariance)
    freedom = problem.freedom(fit)
    sound = needed and fit.converged and problem.candidates.within(touches)
    return Estimate(
        xy=touches[:, :2],
        force=touches[:, 2],
        covariance=spread,
        chi2=fit.chi2,
        dof=freedom,
        p_value=float(chdtrc(freedom, fit.chi2 / (1.0 + added))),
        result=_judge(touches, spread, sound),
        stats=problem.stats(fit),
        systematic=(1.0 - 1.0 / wider) * spread if added else None,
    )


def added_variance(forward: Forward, touches: F64, size: int) -> float:
    """Variance that the own error of a model adds to each of `size` numbers, were it even."""
    return forward.own_error(touches) ** 2 / size


def widening(touches: F64, added: float) -> float:
    """Factor of the covariance of touches (n, 3) by such a variance."""
    return 1.0 + ALIKE * len(touches) ** 2 * added


def _judge(touches: F64, spread: F64, sound: bool) -> Result:
    if not len(touches):
        return Result.NO_TOUCH
    _, evidence, _, _, apart = weak_or_close(touches, spread)
    if sound and evidence >= SURE**2 and apart >= APART**2:
        return Result.FOUND
    return Result.UNRESOLVABLE

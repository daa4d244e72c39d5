"""Touches from a measurement of which a part is false: iteratively reweighted least squares.

Each measurement is trusted by how well touches explain it, and touches are found again with that
trust: first by Huber's weights, which find the neighbourhood from any start, then by Tukey's, which
leave false measurements out altogether (Holland & Welsch 1977). What then lies far from the fit is
left out, and the rest is fitted as usual.
"""

from __future__ import annotations

import numpy as np

from models.arrays import F64
from models.estimate import Estimate
from models.forward.linear import LinearForward
from models.inverse.candidates import CandidateGrid
from models.inverse.greedy import GAIN
from models.inverse.solver import check_measured, find, touch_limit

HUBER, TUKEY = 1.345, 4.685  # standard deviations: 95 % efficient where the noise is normal
NORMAL = 1.4826  # from the median of |normal| to its standard deviation
ROUNDS = 10  # at most of each kind
STILL = 0.01  # largest change of a weight at which weights have settled
HONEST = 0.7  # fraction of the measurements that is always trusted: a touch must explain these


def find_robust(
    measured: F64, candidates: CandidateGrid, *, count: int | None = None, max_touches: int = 4
) -> Estimate:
    """Find touches where up to a quarter of the measurements is false.

    Parameters
    ----------
    measured : (m,) float64
        In units of its noise.
    candidates : CandidateGrid
        Of a forward model that is linear in the forces.
    count, max_touches
        As for `find`.

    Returns
    -------
    Estimate
        Of the measurements that are believed; `dof` says how many these are.

    Raises
    ------
    ValueError
        As `find`, or if the forward model is not linear.
    """
    if not isinstance(candidates.forward, LinearForward):
        raise ValueError("false measurements are found with a linear forward model only; use one")
    limit = touch_limit(count, max_touches)
    measured = check_measured(measured, candidates)
    touches = np.empty((0, 3))
    cost = _honest(measured)
    for number in range(1, limit + 1):
        larger = _reweighted(measured, candidates, touches, number)
        after = _honest(measured - _explained(candidates, larger))
        if count is None and cost - after < GAIN:
            break
        touches, cost = larger, after
    residual = measured - _explained(candidates, touches)
    believed = (np.abs(residual) <= TUKEY * spread(residual)).astype(np.float64)
    trusting = candidates.weighted(believed)
    return find(measured * believed, trusting, start=touches, count=count, max_touches=max_touches)


def _reweighted(measured: F64, candidates: CandidateGrid, touches: F64, number: int) -> F64:
    """Touches (number, 3) of the least robust cost that is reached from fewer."""
    for law in (huber, tukey):
        weight = np.zeros(len(measured))
        for _ in range(ROUNDS):
            residual = measured - _explained(candidates, touches)
            scale = spread(residual)
            before, weight = weight, law(residual / scale)
            if np.abs(weight - before).max() < STILL:
                break
            trust = np.sqrt(weight) / scale
            estimate = find(
                measured * trust, candidates.weighted(trust), start=touches, count=number
            )
            touches = np.column_stack([estimate.xy, estimate.force])
    return touches


def _explained(candidates: CandidateGrid, touches: F64) -> F64:
    return candidates.forward.read(touches)[0]


def spread(residual: F64) -> float:
    """Spread of the honest part of a residual; 1 at least, as its noise is known."""
    return max(1.0, NORMAL * float(np.median(np.abs(residual))))


def _honest(residual: F64) -> float:
    """Sum of squares of the smallest part of a residual."""
    squares = np.sort(residual**2)
    return float(squares[: round(HONEST * len(squares))].sum())


def huber(residual: F64) -> F64:
    """Weights of residuals in units of their spread, which bound what each has to say."""
    return np.minimum(1.0, HUBER / np.maximum(np.abs(residual), HUBER))


def tukey(residual: F64) -> F64:
    """Weights of residuals in units of their spread, zero for those far away."""
    return np.square(np.maximum(1.0 - np.square(residual / TUKEY), 0.0))

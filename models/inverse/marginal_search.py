"""Touches where the bench is not known exactly: found one by one, each in the scatter of the last.

What is not known of a bench grows with the touches themselves. So the measurement is whitened
anew, about the touches found so far, before it is asked for one more.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from models.arrays import F64
from models.bench.bench import BenchEstimate
from models.bench.marginal import marginal
from models.estimate import Estimate, Result
from models.forward.bench_forward import BenchForward
from models.inverse.candidates import CandidateGrid
from models.inverse.levenberg_marquardt import LevenbergMarquardt
from models.inverse.prior import FLAT, Prior
from models.inverse.solver import STANDARD, find

# Of a standard deviation: touches that moved by less were whitened well enough.
_MOVED = 0.5
_ROUNDS = 4


def find_on_bench(
    measured: F64,
    candidates: CandidateGrid,
    forward: BenchForward,
    bench: BenchEstimate,
    *,
    start: F64,
    count: int | None = None,
    max_touches: int = 4,
    prior: Prior = FLAT,
    solver: LevenbergMarquardt = STANDARD,
) -> Estimate:
    """Find touches from a measurement in units of its noise; see `find`.

    Parameters
    ----------
    measured : (m,) float64
    candidates : CandidateGrid
        Of `forward`.
    forward : BenchForward
    bench : BenchEstimate
    start, count, max_touches, prior, solver
        As for `find`.

    Returns
    -------
    Estimate
        UNRESOLVABLE also where the touches do not come to rest in the scatter about themselves.
    """
    limit = max_touches if count is None else count

    def fit(about: F64, touches: F64) -> Estimate:
        there, allowed = marginal(forward, bench, about), min(len(touches) + 1, limit)
        return find(
            there.whitening @ measured,
            replace(candidates, forward=there, response=candidates.response @ there.whitening.T),
            start=touches,
            count=None if count is None else allowed,
            max_touches=allowed,
            prior=prior,
            solver=solver,
        )

    about = touches = start[:limit]
    for _ in range(_ROUNDS + limit):
        estimate = fit(about, touches)
        found = np.column_stack([estimate.xy, estimate.force])
        alike = len(found) == len(touches)
        if alike and _near(about, found, estimate.covariance):
            return estimate
        # What is not known about a touch grows with it, and draws it back: half-way lies between.
        about, touches = 0.5 * (about + found) if alike else found, found
    return replace(fit(about, touches), result=Result.UNRESOLVABLE)


def _near(before: F64, after: F64, covariance: F64) -> bool:
    """Whether touches moved by less than they are sure."""
    sigma = np.sqrt(np.diag(covariance)).reshape(-1, 3)
    return bool((np.abs(after - before) <= _MOVED * sigma).all())

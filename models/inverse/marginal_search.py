"""Touches where the bench is not known exactly: found one by one, each in the scatter of the last.

What is not known of a bench grows with the touches themselves. So those found so far come to rest
in the scatter about themselves before the measurement is asked for one more. And what they leave
unexplained may be a bench so far from the likeliest that its effect is not linear: the scatter is
then that about the bench which the frame itself shows.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from models.arrays import F64
from models.bench.bench import BenchEstimate
from models.bench.learning import likeliest
from models.bench.marginal import MarginalForward, marginal
from models.estimate import Estimate, Result
from models.forward.bench_forward import BenchForward
from models.inverse.candidates import CandidateGrid
from models.inverse.levenberg_marquardt import LevenbergMarquardt
from models.inverse.prior import FLAT, Prior
from models.inverse.solver import STANDARD, find

# Touches that moved by less were whitened well enough: parts of a standard deviation, or of the
# plate's shorter side and of the force, over which what is not known hardly changes.
_MOVED, _APART, _STRONGER = 0.5, 0.004, 0.03
# Fall of χ² below which a fit has converged: a thirtieth of a standard deviation.
_TOLERANCE = 1e-3
_ROUNDS = 4
# Probability below which a frame may show that the bench is far from where it was looked for, and
# by how many standard deviations of the noise its effect must be other than linear.
_STRANGE, _LINEAR = 1e-3, 1.0


class Uncertain(NamedTuple):
    """A forward model, what is known of its bench, and touches that ended.

    Attributes
    ----------
    forward : BenchForward
    bench : BenchEstimate
    left : (n, 3) float64, mm, mm, N
        Touches of which the plate may still show a part.
    """

    forward: BenchForward
    bench: BenchEstimate
    left: F64

    def moved(self, measured: F64, touches: F64) -> Uncertain:
        """Move to the bench that a frame shows, where what it does is not linear up to there."""
        there = likeliest(self.forward, self.bench, measured, touches, self.left)
        if there is None:
            return self
        change = there.fields.values - self.forward.fields.values
        linear = self.forward.read(touches)[0] + change @ self.forward.by_bench(touches)
        far = np.linalg.norm(there.read(touches)[0] - linear) > _LINEAR
        return self._replace(forward=there) if far else self

    def about(self, touches: F64) -> MarginalForward:
        """Whiten it by all that is not known, as that is under touches (n, 3)."""
        return marginal(self.forward, self.bench, touches, self.left)


def find_on_bench(
    measured: F64,
    candidates: CandidateGrid,
    uncertain: Uncertain,
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
        Of the forward model.
    uncertain : Uncertain
    start, count, max_touches, prior, solver
        As for `find`.

    Returns
    -------
    Estimate
        UNRESOLVABLE also where the touches do not come to rest in the scatter about themselves.
    """
    limit = max_touches if count is None else count
    solver = replace(solver, tolerance=max(solver.tolerance, _TOLERANCE))

    def fit(on: Uncertain, about: F64) -> Estimate:
        there, allowed = on.about(about), min(len(about) + 1, limit)
        return find(
            there.whitened(measured),
            replace(candidates, forward=there, response=candidates.response @ there.whitening.T),
            start=about,
            count=None if count is None else allowed,
            max_touches=allowed,
            prior=prior,
            solver=solver,
        )

    on, about, moved = uncertain, start[:limit], False
    for _ in range(_ROUNDS + limit + 1):
        estimate = fit(on, about)
        if not moved and _unexplained(estimate, about):
            moved, there = True, on.moved(measured, about)
            if there is not on:
                on, about = (
                    there,
                    _settled(measured, there, about, candidates.bounds, prior, solver),
                )
                continue
        found = np.column_stack([estimate.xy, estimate.force])
        if len(found) == len(about) and _near(on, about, found, estimate.covariance):
            return estimate
        about = _settled(measured, on, found, candidates.bounds, prior, solver)
    return replace(fit(on, about), result=Result.UNRESOLVABLE)


def _unexplained(estimate: Estimate, about: F64) -> bool:
    """Whether touches (n, 3) leave what a further one explains, or nothing does."""
    return len(about) > 0 and (estimate.count > len(about) or estimate.p_value < _STRANGE)


def _settled(
    measured: F64,
    uncertain: Uncertain,
    touches: F64,
    bounds: F64,
    prior: Prior,
    solver: LevenbergMarquardt,
) -> F64:
    """Let touches (n, 3) come to rest in the scatter about themselves."""
    about = touches
    for _ in range(_ROUNDS if len(touches) else 0):
        there = uncertain.about(about)
        white = there.whitened(measured)
        fit = solver.descend(there, white, touches, bounds=bounds, prior=prior)
        if _near(uncertain, about, fit.touches, fit.covariance):
            return fit.touches
        # What is not known about a touch grows with it, and draws it back: half-way lies between.
        about, touches = 0.5 * (about + fit.touches), fit.touches
    return touches


def _near(uncertain: Uncertain, before: F64, after: F64, covariance: F64) -> bool:
    """Whether touches moved so little that the scatter about them is the same."""
    close = np.full(after.shape, _APART * min(uncertain.forward.plate.size))
    close[:, 2] = _STRONGER * np.abs(after[:, 2])
    sigma = np.sqrt(np.diag(covariance)).reshape(-1, 3)
    return bool((np.abs(after - before) <= np.maximum(close, _MOVED * sigma)).all())

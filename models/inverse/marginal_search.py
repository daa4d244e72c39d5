"""Touches where the bench is not known exactly: found one by one, each in the scatter of the last.

What is not known of a bench grows with the touches themselves. So those found so far come to rest
in the scatter about themselves before the measurement is asked for one more.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from models.arrays import F64
from models.bench.bench import BenchEstimate
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
# Fall of χ² below which a fit has converged. A last step that promises so little, a tenth of a
# standard deviation, is taken and leaves about its square.
_TOLERANCE = 0.01
_ROUNDS = 4


class Whitened(NamedTuple):
    """A search in units of noise and of what is not known, as it is about some touches.

    Attributes
    ----------
    touches : (n, 3) float64, mm, mm, N
    left : (k, 3) float64, mm, mm, N
        Touches that ended.
    forward : MarginalForward
    candidates : CandidateGrid
        Of that forward model.
    """

    touches: F64
    left: F64
    forward: MarginalForward
    candidates: CandidateGrid


@dataclass(frozen=True, eq=False)
class Uncertain:
    """A search for touches on a bench of which only so much is known.

    Attributes
    ----------
    bench : BenchEstimate
    candidates : CandidateGrid
        Of a `BenchForward`.
    """

    bench: BenchEstimate
    candidates: CandidateGrid
    _last: dict[int, Whitened] = field(default_factory=dict[int, Whitened], repr=False)

    @property
    def forward(self) -> BenchForward:
        """The forward model on the most likely bench.

        Raises
        ------
        TypeError
            The candidates are those of another forward model.
        """
        forward = self.candidates.forward
        if not isinstance(forward, BenchForward):
            raise TypeError(f"a bench needs a BenchForward, got a {type(forward).__name__}")
        return forward

    def about(self, touches: F64, left: F64) -> Whitened:
        """Whiten it by all that is not known under touches (n, 3), or by what it was near by."""
        last = self._last.get(len(touches))
        known = last is not None and np.array_equal(last.left, left)
        if last is not None and known and self.near(last.touches, touches):
            return last
        there = marginal(self.forward, self.bench, touches, left)
        whitened = Whitened(touches, left, there, self.candidates.through(there, there.whitening))
        self._last[len(touches)] = whitened
        return whitened

    def near(self, before: F64, after: F64, covariance: F64 | None = None) -> bool:
        """Whether touches moved so little that the scatter about them is the same."""
        close = np.full(after.shape, _APART * min(self.forward.plate.size))
        close[:, 2] = _STRONGER * np.abs(after[:, 2])
        if covariance is not None:
            sigma = np.sqrt(np.diag(covariance)).reshape(-1, 3)
            close = np.maximum(close, _MOVED * sigma)
        return bool((np.abs(after - before) <= close).all())


def find_on_bench(
    measured: F64,
    uncertain: Uncertain,
    *,
    start: F64,
    left: F64,
    count: int | None = None,
    max_touches: int = 4,
    prior: Prior = FLAT,
    solver: LevenbergMarquardt = STANDARD,
) -> Estimate:
    """Find touches from a measurement in units of its noise; see `find`.

    Parameters
    ----------
    measured : (m,) float64
    uncertain : Uncertain
    start : (n, 3) float64, mm, mm, N
    left : (k, 3) float64, mm, mm, N
        Touches that ended, of which the plate may still show a part.
    count, max_touches, prior, solver
        As for `find`.

    Returns
    -------
    Estimate
        UNRESOLVABLE also where the touches do not come to rest in the scatter about themselves.
    """
    limit = max_touches if count is None else count
    solver = replace(solver, tolerance=max(solver.tolerance, _TOLERANCE))

    def fit(there: Whitened, start: F64) -> Estimate:
        allowed = min(len(there.touches) + 1, limit)
        return find(
            there.forward.whitening @ measured,
            there.candidates,
            start=start,
            count=None if count is None else allowed,
            max_touches=allowed,
            prior=prior,
            solver=solver,
        )

    touches = start[:limit]
    there = uncertain.about(touches, left)
    for rounds in range(_ROUNDS + limit):
        estimate = fit(there, touches)
        touches = np.column_stack([estimate.xy, estimate.force])
        if len(touches) == len(there.touches) and uncertain.near(
            there.touches, touches, estimate.covariance
        ):
            return estimate
        if rounds == 0 and len(touches) == len(start):  # they have moved since the last frame
            there = uncertain.about(touches, left)
        else:
            there, touches = _settled(measured, uncertain, touches, left, prior, solver)
    return replace(fit(there, touches), result=Result.UNRESOLVABLE)


def _settled(
    measured: F64,
    uncertain: Uncertain,
    touches: F64,
    left: F64,
    prior: Prior,
    solver: LevenbergMarquardt,
) -> tuple[Whitened, F64]:
    """Let touches (n, 3) come to rest in the scatter about themselves."""
    there = uncertain.about(touches, left)
    for _ in range(_ROUNDS if len(touches) else 0):
        white, bounds = there.forward.whitening @ measured, there.candidates.bounds
        fit = solver.descend(there.forward, white, touches, bounds=bounds, prior=prior)
        if uncertain.near(there.touches, fit.touches, fit.covariance):
            return there, fit.touches
        # What is not known about a touch grows with it, and draws it back: half-way lies between.
        half_way, touches = 0.5 * (there.touches + fit.touches), fit.touches
        there = uncertain.about(half_way, left)
    return uncertain.about(touches, left), touches

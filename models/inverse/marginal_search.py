"""Touches where the bench is not known exactly: found one by one, each in the scatter of the last.

What is not known of a bench grows with the touches themselves. So those found so far come to rest
in the scatter about themselves before the measurement is asked for one more. And what they leave
unexplained may be a bench so far from the likeliest that its effect is not linear: the scatter is
then that about the bench which the frame itself shows.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from models.arrays import F64
from models.bench.bench import NAMES, BenchEstimate
from models.bench.learning import likeliest
from models.bench.marginal import MarginalForward, marginal, noise_covariance
from models.bench.traces import Traces
from models.estimate import Estimate, Result
from models.forward.bench_forward import BenchForward
from models.inverse.candidates import CandidateGrid
from models.inverse.levenberg_marquardt import LevenbergMarquardt
from models.inverse.prior import FLAT, Prior
from models.inverse.solver import STANDARD, find

# Touches that moved by less were whitened well enough: parts of a standard deviation, or of the
# plate's shorter side and of the force, over which what is not known hardly changes: σ by 4 %, a
# touch by 0.02 of its σ, by 0.14 at most in nineteen of twenty.
_MOVED, _APART, _STRONGER = 0.5, 0.008, 0.06
# Fall of χ² below which a fit has converged. A last step that promises so little, a tenth of a
# standard deviation, is taken and leaves about its square.
_TOLERANCE = 0.01
_ROUNDS = 4
# Probability below which a frame may show that the bench is far from where it was looked for, and
# by how many standard deviations of the noise its effect must be other than linear.
_STRANGE, _LINEAR = 1e-3, 1.0
# Probability of a frame that nothing explains, and the part of χ² that the round before must have
# left for another one to be worth its time: on another plate a search would go round for seconds.
_HOPELESS, _BETTER = 1e-12, 0.5
_TENSION = [NAMES.index(name) for name in ("tension_xx", "tension_yy")]


class Whitened(NamedTuple):
    """A search in units of noise and of what is not known, as it is about some touches.

    Attributes
    ----------
    touches : (n, 3) float64, mm, mm, N
    left : Traces
        Of touches that ended.
    forward : MarginalForward
    candidates : CandidateGrid
        Of that forward model.
    """

    touches: F64
    left: Traces
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
        """The forward model on the bench about which is searched.

        Raises
        ------
        TypeError
            The candidates are those of another forward model.
        """
        forward = self.candidates.forward
        if not isinstance(forward, BenchForward):
            raise TypeError(f"a bench needs a BenchForward, got a {type(forward).__name__}")
        return forward

    def moved(self, measured: F64, touches: F64, left: Traces) -> Uncertain:
        """Move to the bench that a frame shows, where what it does is not linear up to there.

        It is the tension that is far from linear; once that is known, the likeliest bench is near.
        """
        if self.bench.known[_TENSION].all():
            return self
        there = likeliest(self.forward, self.bench, measured, touches, left)
        if there is None:
            return self
        change = there.fields.values - self.forward.fields.values
        linear = self.forward.read(touches)[0] + change @ self.forward.by_bench(touches)
        if np.linalg.norm(there.read(touches)[0] - linear) < _LINEAR:
            return self
        return Uncertain(self.bench, replace(self.candidates, forward=there))

    def about(self, touches: F64, left: Traces) -> Whitened:
        """Whiten it by all that is not known under touches (n, 3), or by what it was near by."""
        last = self._near_by(touches, left)
        if last is not None:
            return last
        there = marginal(self.forward, self.bench, touches, left)
        whitened = Whitened(touches, left, there, self.candidates.through(there, there.whitening))
        self._last[len(touches)] = whitened
        return whitened

    def forward_about(self, touches: F64, left: Traces) -> MarginalForward:
        """Whiten the forward model alone, which will keep no state for the next search."""
        last = self._near_by(touches, left)
        there = marginal(self.forward, self.bench, touches, left) if last is None else last.forward
        state = self.forward.fields.state(touches)
        return replace(there, forward=there.forward.near(state))

    def without_memory(self, measured: F64, left: Traces) -> F64:
        """Take what a plate without touches still shows of those that ended off it, (m,).

        Of what is measured, noise keeps the part that is its own of all that scatters.
        """
        none = np.empty((0, 3))
        last = self._near_by(none, left)
        there = marginal(self.forward, self.bench, none, left) if last is None else last.forward
        return there.whitening.T @ there.whitened(measured)

    def _near_by(self, touches: F64, left: Traces) -> Whitened | None:
        """Return what it was whitened by last, where that was near by."""
        last = self._last.get(len(touches))
        known = last is not None and last.left.same(left)
        return last if last is not None and known and self.near(last.touches, touches) else None

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
    left: Traces,
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
    left : Traces
        What the plate may still show of touches that ended.
    count, max_touches, prior, solver
        As for `find`.

    Returns
    -------
    Estimate
        UNRESOLVABLE also where the touches do not come to rest in the scatter about themselves,
        or nothing explains the measurement.
    """
    limit = max_touches if count is None else count
    solver = replace(solver, tolerance=max(solver.tolerance, _TOLERANCE))

    def fit(there: Whitened, start: F64) -> Estimate:
        allowed = min(len(there.touches) + 1, limit)
        return find(
            there.forward.whitened(measured),
            there.candidates,
            start=start,
            count=None if count is None else allowed,
            max_touches=allowed,
            prior=prior,
            solver=solver,
        )

    touches, on, looked, left_over = start[:limit], uncertain, False, np.inf
    there = on.about(touches, left)
    for rounds in range(_ROUNDS + limit + 1):
        estimate = fit(there, touches)
        if not looked and _unexplained(estimate, there.touches):
            looked, on = True, uncertain.moved(measured, there.touches, left)
            if on is not uncertain:
                there, touches = _settled(measured, on, there.touches, left, prior, solver)
                continue
        touches = np.column_stack([estimate.xy, estimate.force])
        if len(touches) == len(there.touches) and on.near(
            there.touches, touches, estimate.covariance
        ):
            return _with_systematic(estimate, there.forward)
        if estimate.p_value < _HOPELESS and estimate.chi2 > _BETTER * left_over:
            break
        left_over = estimate.chi2
        if rounds == 0 and len(touches) == len(start):  # they have moved since the last frame
            there = on.about(touches, left)
        else:
            there, touches = _settled(measured, on, touches, left, prior, solver)
    else:
        estimate = fit(there, touches)
    return replace(_with_systematic(estimate, there.forward), result=Result.UNRESOLVABLE)


def _with_systematic(estimate: Estimate, forward: MarginalForward) -> Estimate:
    """Say what of its covariance is not noise."""
    if not estimate.count or not np.isfinite(estimate.covariance).all():
        return estimate
    touches = np.column_stack([estimate.xy, estimate.force])
    noise = noise_covariance(forward, touches, estimate.covariance)
    return replace(estimate, systematic=estimate.covariance - noise)


def _unexplained(estimate: Estimate, touches: F64) -> bool:
    """Whether touches (n, 3) leave what a further one explains, or nothing does."""
    return len(touches) > 0 and (estimate.count > len(touches) or estimate.p_value < _STRANGE)


def _settled(
    measured: F64,
    uncertain: Uncertain,
    touches: F64,
    left: Traces,
    prior: Prior,
    solver: LevenbergMarquardt,
) -> tuple[Whitened, F64]:
    """Let touches (n, 3) come to rest in the scatter about themselves."""
    there = uncertain.about(touches, left)
    for _ in range(_ROUNDS if len(touches) else 0):
        white, bounds = there.forward.whitened(measured), there.candidates.bounds
        fit = solver.descend(there.forward, white, touches, bounds=bounds, prior=prior)
        if uncertain.near(there.touches, fit.touches, fit.covariance):
            return there, fit.touches
        # What is not known about a touch grows with it, and draws it back: half-way lies between.
        half_way, touches = 0.5 * (there.touches + fit.touches), fit.touches
        there = uncertain.about(half_way, left)
    return uncertain.about(touches, left), touches

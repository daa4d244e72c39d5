"""Whether touches accuse a bench: a score test with a stated rate of false alarms.

About the bench as described, the slope of χ² by a cause's numbers is noise where nothing is wrong.
Two noises are shared by all touches and do not average out: that of the reference image, and what
the model leaves out of every touch. The fall of χ² that a cause promises is then a weighted sum of
squares of normal numbers, of which the tail is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import copysign, log, sqrt

import numpy as np
from scipy.optimize import brentq
from scipy.stats import norm

from models.arrays import F64, Mask
from models.bench.bench import NAMES
from models.bench.joint import JointProblem, State, solve_lower, through, whiten
from models.bench.marginal import own_error
from models.forward.bench_forward import BenchForward

FALSE_ALARM = 1e-4
"""p-value below which a bench is accused, by whatever cause.

Far below the one in a hundred that may be accused: small p-values of right benches are twice as
frequent as they say, for what tiles of one pattern see wrongly is not in their spread.
"""

_AT_MEAN = 1e-3  # of the mean, within which the saddle point is that of its border


@dataclass(frozen=True, eq=False)
class Slopes:
    """Slope of χ² by numbers of a bench, touches eliminated, in parts of each prior's σ.

    Attributes
    ----------
    free : (63,) bool
        The P numbers that these are.
    slope : (P,) float64
    normal : (P, P) float64
        Without the priors.
    spread : (P, P) float64
        Covariance of the slope where the bench is as described.
    """

    free: Mask
    slope: F64
    normal: F64
    spread: F64

    def of(self, names: Sequence[str]) -> Slopes:
        """Return those of some of the numbers."""
        chosen = np.array([name in names for name in NAMES])
        kept = np.flatnonzero(chosen[self.free])
        square = np.ix_(kept, kept)
        slope, normal, spread = self.slope[kept], self.normal[square], self.spread[square]
        return Slopes(chosen & self.free, slope, normal, spread)

    def less_sure(self, covariance: F64) -> Slopes:
        """Return those about a bench that is itself known to a covariance alone.

        Parameters
        ----------
        covariance : (P, P) float64
            Of these numbers, in parts of each prior's σ.
        """
        return replace(self, spread=self.spread + self.normal @ covariance @ self.normal)

    @property
    def step(self) -> F64:
        """Where the numbers go to first order, (P,) in parts of each prior's σ."""
        step = np.linalg.solve(self.normal + np.eye(len(self.slope)), self.slope)
        return np.asarray(step, dtype=np.float64)

    @property
    def fall(self) -> float:
        """Fall of χ² with the priors, to first order."""
        return float(self.slope @ self.step)

    @property
    def p_value(self) -> float:
        """Probability of as much of a fall where the bench is as described."""
        whitened = np.linalg.cholesky(self.normal + np.eye(len(self.slope)))
        half = solve_lower(whitened, solve_lower(whitened, self.spread).T)
        return tail(np.asarray(np.linalg.eigvalsh(half), dtype=np.float64), self.fall)


def slopes(problem: JointProblem, on: BenchForward, state: State) -> Slopes:
    """Compute the slope of χ² at the touches that fit best on the bench as described.

    What the noise of the reference brings into all measurements alike does not average.

    Parameters
    ----------
    problem : JointProblem
        With the numbers of all causes free.
    on : BenchForward
        The bench as described.
    state : State
    """
    count = len(problem.scales)
    slope, normal = np.zeros(count), np.zeros((count, count))
    alike, missing = np.zeros((2, count, len(on.whitening)))
    given = zip(problem.factors, problem.presses, state.touches, strict=True)
    for factor, press, touch in given:
        seen = through(on, press)
        residual, own, shared = whiten(problem, seen, factor, press, touch)
        tangent = np.linalg.qr(own)[0]
        shared = shared - tangent @ (tangent.T @ shared)
        slope += shared.T @ residual
        normal += shared.T @ shared
        by_error = shared.T @ solve_lower(factor, np.eye(len(factor)))
        alike += press.reference * by_error
        missing += sqrt(own_error(seen.read(touch[None])[0])) * by_error
    spread = normal + alike @ alike.T
    spread += problem.prior.discrepancy**2 * missing @ missing.T
    return Slopes(problem.free, slope, normal, spread)


def tail(weights: F64, value: float) -> float:
    """Probability that a weighted sum of squares of standard normal numbers exceeds a value.

    Saddle point of Lugannani and Rice (Kuonen 1999, doi 10.1093/biomet/86.4.929): some per cent
    of the probability, however small that is.

    Parameters
    ----------
    weights : (n,) float64
        Positive.
    value : float
    """
    weights = weights[weights > 1e-12 * weights.max()]
    mean, largest = float(weights.sum()), float(weights.max())
    if value <= 0.0:
        return 1.0
    if abs(value / mean - 1.0) < _AT_MEAN:
        value = (1.0 + _AT_MEAN) * mean

    def beyond(at: float) -> float:
        return float(np.sum(weights / (1.0 - 2.0 * at * weights))) - value

    # The sum is the mean at 0, no less than its largest term, no more than that of equal weights.
    low, high = -len(weights) / value, 0.5 * (1.0 - (1.0 - 1e-9) * largest / value) / largest
    ends = (low, 0.0) if value < mean else (0.0, high)
    at = float(brentq(beyond, *ends))
    grown = -0.5 * float(np.sum(np.log1p(-2.0 * at * weights)))
    bent = 2.0 * float(np.sum((weights / (1.0 - 2.0 * at * weights)) ** 2))
    away = copysign(sqrt(2.0 * (at * value - grown)), at)
    return float(norm.sf(away + log(at * sqrt(bent) / away) / away))

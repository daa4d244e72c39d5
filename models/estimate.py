"""What an estimator says of one measurement: touches, how sure, and whether to believe it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from models.arrays import F64


class Result(Enum):
    """Outcome of an estimate; the value is the sentence that a user reads."""

    FOUND = "touches found"
    NO_TOUCH = "no touch"
    UNRESOLVABLE = "touches are too close together, too near an edge or too weak to tell"


class SolverStats(NamedTuple):
    """What it took to find touches.

    Attributes
    ----------
    descents : int
        Fits that were begun: with one touch more, with one less, from another start.
    steps : int
        Steps that these tried.
    evaluations : int
        Times that they read the forward model.
    converged : bool
        Whether the fit that is stated ended by itself, not by the largest number of steps.
    """

    descents: int
    steps: int
    evaluations: int
    converged: bool


NO_DESCENT = SolverStats(0, 0, 0, True)


class ForceInterval(NamedTuple):
    """Forces of one touch that a measurement allows, by profile likelihood.

    Attributes
    ----------
    level_68, level_95 : (float, float), N
        Lower and upper bound where χ² is higher by 1 and by 4, whatever place and other touches
        are best for it. The lower one is 0 where no force at all fits as well, and the upper one
        infinite where χ² does not bound it; both are NaN where they were not found.
    """

    level_68: tuple[float, float]
    level_95: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Estimate:
    """Touches that explain a measurement.

    Attributes
    ----------
    xy : (n, 2) float64, mm
        Places on the touched face, sorted by x, then y.
    force : (n,) float64, N
        Forces into the plate.
    covariance : (3n, 3n) float64
        Covariance of (x1, y1, F1, x2, …), mm and N: the inverse Fisher matrix at the solution, and
        what the forward model's own error adds to it.
    chi2 : float
        Sum of squared whitened residuals.
    dof : int
        Measurements less unknowns, 1 at least.
    p_value : float
        Probability of a larger `chi2` if noise, and the own error of the forward model, are right.
    result : Result
    stats : SolverStats
        Steps of the solver; none where it was not run.
    force_intervals : (n,) tuple of ForceInterval or None
        Of each touch where `covariance` says too little of its force, near an edge for instance;
        None of others. Empty where they were not asked for; see `Estimator.with_force_intervals`.
    systematic : (3n, 3n) float64 or None
        The part of `covariance` that is the same in every frame of touches at rest, which no mean
        over frames makes smaller: what is not known of the bench, and the forward model's own
        error. None where all of it is noise.
    """

    xy: F64
    force: F64
    covariance: F64
    chi2: float
    dof: int
    p_value: float
    result: Result
    stats: SolverStats = NO_DESCENT
    force_intervals: tuple[ForceInterval | None, ...] = ()
    systematic: F64 | None = None

    @property
    def count(self) -> int:
        """Number of touches."""
        return len(self.force)

    def touch_covariance(self, index: int) -> F64:
        """Covariance of x, y, F of one touch, (3, 3), mm and N."""
        return _block(self.covariance, index)

    def touch_systematic(self, index: int) -> F64:
        """Systematic part of the covariance of one touch, (3, 3), mm and N."""
        return np.zeros((3, 3)) if self.systematic is None else _block(self.systematic, index)


def _block(covariance: F64, index: int) -> F64:
    block = slice(3 * index, 3 * index + 3)
    return covariance[block, block]

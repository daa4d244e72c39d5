"""Bounds of a force where the likelihood is not symmetric: near an edge, and where it is weak.

Near an edge a weak touch further in moves the plate as a strong one further out does, and the
covariance at the solution does not say how far either may go. The profile likelihood does: χ² at a
force, least in all else (Venzon & Moolgavkar 1988). Newton steps along its valley find the bounds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, inf, nan, sqrt

import numpy as np

from models.arrays import F64
from models.estimate import Estimate, ForceInterval
from models.forward.linear import Forward
from models.inverse.candidates import CandidateGrid
from models.inverse.normal_equations import active_bounds, assemble
from models.inverse.prior import Prior
from models.inverse.solver import added_variance, widening

NEAR_EDGE = 25.0  # mm from an edge up to which χ² is no parabola of the force
UNSURE = 0.2  # standard deviation of a force in parts of it, from which on it is none anywhere
LOW, HIGH = 0.02, 10.0  # times the force: where a bound counts as none
STEPS = 15  # of Newton, at most; three are usual
CLOSE = 0.02  # standard deviations of the force that a bound may be off
LONGEST = 0.7  # largest step of the logarithm of the force


@dataclass(frozen=True, eq=False)
class Valley:
    """χ² along a force, least in all else: a parabola about some touches.

    Attributes
    ----------
    base, gradient, curvature : float
        χ² at the force of these touches, and its derivatives by N: the first, and half the second.
    onto, along : (3n,) float64
        Step onto the floor of the valley, and how all unknowns go along it by 1 N.
    """

    base: float
    gradient: float
    curvature: float
    onto: F64
    along: F64

    def step_to(self, chi2: float, side: float) -> float:
        """Change of the force to where χ² has a value, on one side; else to the lowest."""
        root = self.gradient**2 - 4.0 * self.curvature * (self.base - chi2)
        return (side * sqrt(max(root, 0.0)) - self.gradient) / (2.0 * self.curvature)


@dataclass(frozen=True, eq=False)
class ForceProfile:
    """What bounds the forces of a measurement.

    Attributes
    ----------
    measured : (m,) float64
    forward : Forward
    bounds : (2, 3) float64, mm, mm, N
        Smallest and largest x, y, F.
    prior : Prior
    """

    measured: F64
    forward: Forward
    bounds: F64
    prior: Prior

    def valley(self, touches: F64, index: int) -> Valley:
        """Describe χ² about touches (n, 3) along the force of one of them."""
        predicted, jacobian = self.forward.read(touches)
        residual, (mean, precision) = self.measured - predicted, self.prior
        fisher, slope = assemble(jacobian, residual, touches, mean, precision)
        cost = residual @ residual + (precision * np.square(mean - touches)).sum()
        force = 3 * index + 2
        free = ~active_bounds(touches, slope, self.bounds) & (np.diag(fisher) > 0)
        free[force] = False
        onto, along = np.zeros(len(slope)), np.zeros(len(slope))
        rows = np.column_stack([slope[free], -fisher[free, force]])
        onto[free], along[free] = np.linalg.lstsq(fisher[free][:, free], rows)[0].T
        along[force] = 1.0
        base = float(cost - slope @ onto)
        return Valley(base, -2.0 * float(slope @ along), float(fisher[force] @ along), onto, along)

    def bound(self, touches: F64, index: int, chi2: float, side: float) -> tuple[float, F64]:
        """Find the force at which χ² has a value, and the touches there; start from some."""
        first = touches[index, 2]
        for _ in range(STEPS):
            valley = self.valley(touches, index)
            if not valley.curvature > 0:
                break
            change = valley.step_to(chi2, side)
            if abs(change) * sqrt(valley.curvature) < CLOSE:
                return float(touches[index, 2] + change), touches
            touches = self._stepped(touches, index, valley, change)
            if touches[index, 2] < LOW * first:
                return 0.0, touches
            if touches[index, 2] > HIGH * first:
                return inf, touches
        return nan, touches

    def _stepped(self, touches: F64, index: int, valley: Valley, change: float) -> F64:
        """Go along the valley; the force by its logarithm, as it goes with the place."""
        force = touches[index, 2]
        logarithm = min(max(change / force, -LONGEST), LONGEST)
        step = valley.onto + logarithm * force * valley.along
        after = np.clip(touches + step.reshape(-1, 3), *self.bounds)
        after[index, 2] = force * exp(logarithm)
        return after


def with_force_intervals(
    estimate: Estimate, measured: F64, candidates: CandidateGrid, prior: Prior
) -> Estimate:
    """Return an estimate with the interval of each force that its covariance says too little of.

    Parameters
    ----------
    estimate : Estimate
    measured : (m,) float64
        What it is of, in the units of the candidates.
    candidates : CandidateGrid
    prior : Prior
    """
    wanted = _asymmetric(estimate, candidates.forward.plate.size)
    if not wanted.any():
        return replace(estimate, force_intervals=(None,) * estimate.count)
    touches = np.column_stack([estimate.xy, estimate.force])
    forward = candidates.forward
    rise = widening(touches, added_variance(forward, touches, len(measured)))
    profile = ForceProfile(measured, forward, candidates.bounds, prior)
    intervals = tuple(
        _interval(profile, touches, index, rise) if wanted[index] else None
        for index in range(estimate.count)
    )
    return replace(estimate, force_intervals=intervals)


def _asymmetric(estimate: Estimate, size: tuple[float, float]) -> np.ndarray:
    """Which touches (n,) of a plate lie where χ² is no parabola of the force."""
    inside = np.minimum(estimate.xy, np.array(size) - estimate.xy).min(axis=1, initial=inf)
    sigma = np.sqrt(np.diag(estimate.covariance)[2::3])
    return (inside < NEAR_EDGE) | (sigma > UNSURE * estimate.force)


def _interval(profile: ForceProfile, touches: F64, index: int, rise: float) -> ForceInterval:
    """Bound the force of one of some touches (n, 3); `rise` of χ² is one standard deviation."""
    lowest = profile.valley(touches, index).base
    inner, outer = [0.0, 0.0], [0.0, 0.0]
    for k, side in enumerate((-1.0, 1.0)):
        inner[k], there = profile.bound(touches, index, lowest + rise, side)
        outer[k] = inner[k]
        if 0 < inner[k] < inf:
            outer[k], _ = profile.bound(there, index, lowest + 4.0 * rise, side)
    return ForceInterval((inner[0], inner[1]), (outer[0], outer[1]))

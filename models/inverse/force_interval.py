"""Bounds of a force where the likelihood is not symmetric: near an edge, and where it is weak.

Near an edge a weak touch further in moves the plate as a strong one further out does, and the
covariance at the solution does not say how far either may go. The profile likelihood does: χ² at a
force, least in all else (Venzon & Moolgavkar 1988). By the logarithm of the force the root of what
χ² rises by is nearly straight: a bound takes one reading of the forward model, seldom two.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, inf, log, nan, sqrt
from typing import NamedTuple

import numpy as np

from models.arrays import F64, Mask
from models.estimate import Estimate, ForceInterval
from models.forward.linear import Forward
from models.inverse.normal_equations import active_bounds, assemble
from models.inverse.prior import Prior
from models.inverse.solver import added_variance, widening

NEAR_EDGE = 25.0  # mm from an edge up to which χ² is no parabola of the force
UNSURE = 0.2  # standard deviation of a force in parts of it, from which on it is none anywhere
LOW, HIGH = 0.02, 10.0  # times the force: where a bound counts as none
STEPS = 8  # along the valley, at most; one or two are usual
CLOSE = 0.15  # standard deviations over which the root is straight
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


class Bound(NamedTuple):
    """A force, N, at which χ² has a value, and how its logarithm goes by the root of that."""

    force: float
    rate: float


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

    def bound(self, touches: F64, index: int, lowest: Valley, rise: float, side: float) -> Bound:
        """Find the force on one side of some touches (n, 3) at which χ² is higher by `rise`.

        Parameters
        ----------
        touches : (n, 3) float64, mm, mm, N
            Those of the lowest χ².
        index : int
            Of the touch whose force is bounded.
        lowest : Valley
            About them.
        rise : float
        side : {-1, 1}
        """
        first, root, valley = touches[index, 2], sqrt(rise), lowest
        step = root * _first_rate(touches[index, 2], lowest, side)
        for _ in range(STEPS):
            touches = self._stepped(touches, index, valley, step)
            if touches[index, 2] < LOW * first:
                return Bound(0.0, nan)
            if touches[index, 2] > HIGH * first:
                return Bound(inf, nan)
            valley = self.valley(touches, index)
            risen = sqrt(max(valley.base - lowest.base, 0.0))
            slope = float(valley.gradient * touches[index, 2])
            if not (risen and slope * side > 0):
                step = side * LONGEST
                continue
            rate = 2.0 * risen / slope
            step = (root - risen) * rate
            if abs(root - risen) < CLOSE:
                return Bound(float(touches[index, 2]) * exp(step), rate)
        return Bound(nan, nan)

    def _stepped(self, touches: F64, index: int, valley: Valley, logarithm: float) -> F64:
        """Go along the valley; the force by its logarithm, as it goes with the place."""
        force, logarithm = touches[index, 2], min(max(logarithm, -LONGEST), LONGEST)
        step = valley.onto + logarithm * force * valley.along
        after = np.clip(touches + step.reshape(-1, 3), *self.bounds)
        after[index, 2] = force * exp(logarithm)
        return after


def _first_rate(force: float, lowest: Valley, side: float) -> float:
    """How the logarithm of the force goes by the root of what χ² rises by, where it is least."""
    return side / (sqrt(lowest.curvature) * force)


def with_force_intervals(estimate: Estimate, wanted: Mask, profile: ForceProfile) -> Estimate:
    """Return an estimate with the interval of each force that is wanted, (n,) bool."""
    touches = np.column_stack([estimate.xy, estimate.force])
    added = added_variance(profile.forward, touches, len(profile.measured))
    rise = widening(touches, added)
    intervals = tuple(
        _interval(profile, touches, index, rise) if wanted[index] else None
        for index in range(estimate.count)
    )
    return replace(estimate, force_intervals=intervals)


def asymmetric(estimate: Estimate, size: tuple[float, float]) -> Mask:
    """Which touches (n,) of a plate lie where χ² is no parabola of the force."""
    inside = np.minimum(estimate.xy, np.array(size) - estimate.xy).min(axis=1, initial=inf)
    sigma = np.sqrt(np.diag(estimate.covariance)[2::3])
    return np.asarray((inside < NEAR_EDGE) | (sigma > UNSURE * estimate.force), dtype=bool)


def _interval(profile: ForceProfile, touches: F64, index: int, rise: float) -> ForceInterval:
    """Bound the force of one of some touches (n, 3); `rise` of χ² is one standard deviation."""
    lowest, force = profile.valley(touches, index), float(touches[index, 2])
    inner, outer = [nan, nan], [nan, nan]
    for k, side in enumerate((-1.0, 1.0) if lowest.curvature > 0 else ()):
        bound = profile.bound(touches, index, lowest, 4.0 * rise, side)
        rate = _first_rate(force, lowest, side)
        inner[k], outer[k] = _halfway(force, rate, bound, sqrt(rise)), bound.force
        if not min(force, outer[k]) < inner[k] < max(force, outer[k]):
            inner[k] = profile.bound(touches, index, lowest, rise, side).force
    return ForceInterval((inner[0], inner[1]), (outer[0], outer[1]))


def _halfway(force: float, rate: float, bound: Bound, root: float) -> float:
    """Force where the root of what χ² rises by is `root`, from where that is 0 and twice as much.

    A cubic through both, with the rates there, tells the middle; NaN where there is no bound.
    """
    if not 0 < bound.force < inf:
        return nan
    middle = 0.5 * (log(force) + log(bound.force))
    return exp(middle + 0.25 * root * (rate - bound.rate))

"""Least squares on a forward model: Levenberg-Marquardt on x, y, F of every touch.

After Marquardt (1963), damped as by Nielsen (1999), with the exact Jacobian; places stay on the
plate and forces push. One loop serves all forward models: compiled for those that are linear in
force, as it stands for others.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from models.arrays import F64
from models.checks import check_integer, check_number
from models.forward.linear import Forward, LinearForward
from models.inverse.descent_kernel import Control, descend, descend_table, inverse_fisher
from models.inverse.prior import FLAT, Prior


class Fit(NamedTuple):
    """Touches and what they leave of a measurement.

    Attributes
    ----------
    touches : (n, 3) float64, mm, mm, N
    residual : (m,) float64
        Whitened measurement less what the touches explain.
    jacobian : (3n, m) float64
        Derivatives of the measurement in x1, y1, F1, x2, …
    chi2 : float
        Sum of squares of the residual and of what priors add.
    converged : bool
        Whether no step would lower χ² by more than the tolerance.
    steps : int
        Steps that were tried.
    evaluations : int
        Times that the forward model was read.
    covariance : (3n, 3n) float64, mm and N
        Of x1, y1, F1, x2, …: see `covariance`.
    """

    touches: F64
    residual: F64
    jacobian: F64
    chi2: float
    converged: bool
    steps: int
    evaluations: int
    covariance: F64


@dataclass(frozen=True)
class LevenbergMarquardt:
    """A solver of nonlinear least squares for the touches of any forward model.

    Attributes
    ----------
    max_steps : int
        Five are usual, a hundred where touches are hard to tell apart.
    damping : float
        To begin with, in parts of the diagonal of the normal equations.
    damping_down : float
        Factor of the damping after a step that brought what it promised, 1 after one that brought
        half of that: otherwise every other step through a narrow valley fails.
    damping_up : float
        Factor of the damping after a step that failed.
    max_damping : float
        At which only rounding keeps χ² from falling.
    tolerance : float
        Fall of χ² below which a fit has converged: a thousandth of a standard deviation.

    Raises
    ------
    ValueError
        If a number is out of its range.
    """

    max_steps: int = 300
    damping: float = 1e-4
    damping_down: float = 0.2
    damping_up: float = 3.0
    max_damping: float = 1e8
    tolerance: float = 1e-6

    def __post_init__(self) -> None:
        """Refuse numbers with which no descent could end well."""
        check_integer("max_steps", self.max_steps, 1, "300 are enough")
        check_number("damping", self.damping, "", 0.0)
        check_number("damping_down", self.damping_down, "", 0.0, 1.0)
        check_number("damping_up", self.damping_up, "", 1.0)
        check_number("max_damping", self.max_damping, "", 1.0)
        check_number("tolerance", self.tolerance, "of χ²", 0.0)

    def descend(
        self,
        forward: Forward,
        measured: F64,
        start: F64,
        *,
        bounds: F64,
        prior: Prior = FLAT,
        relative_tolerance: float = 0.0,
    ) -> Fit:
        """Touches of least χ² that lie downhill of a start.

        Parameters
        ----------
        forward : Forward
        measured : (m,) float64
            In units of its noise.
        start : (n, 3) float64, mm, mm, N
            x, y, F of each touch.
        bounds : (2, 3) float64, mm, mm, N
            Smallest and largest x, y, F that a touch may take.
        prior : Prior
        relative_tolerance : float
            Fraction of χ² by which a step must lower it to be worth another, for a coarse fit.
        """
        given = (measured, start, bounds, prior, self.control, relative_tolerance)
        if isinstance(forward, LinearForward):
            return Fit(*descend_table(forward.reading, *given))
        fit = descend(forward, *given)
        return Fit(*fit, covariance(fit[2], prior.precision))

    @cached_property
    def control(self) -> Control:
        """The same numbers, as compiled code takes them."""
        factors = (self.damping, self.damping_down, self.damping_up, self.max_damping)
        return Control(int(self.max_steps), *map(float, factors), tolerance=float(self.tolerance))


def covariance(jacobian: F64, precision: F64 = FLAT.precision) -> F64:
    """Inverse Fisher matrix of x, y, F of each touch, (3n, 3n) mm and N.

    Where the measurement says nothing the variance is finite and huge, so that the other touches
    keep theirs.

    Parameters
    ----------
    jacobian : (3n, m) float64
        Of the whitened measurement.
    precision : (3,) float64
        Of the prior.
    """
    return inverse_fisher(jacobian, precision)

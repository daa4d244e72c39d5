"""Balance of the reduced plate under touches, and how it moves with them.

The deflection is w = Σ_t [F_t g_t + Σ_k c_tk h_tk] + Σ_j q_j φ_j. Its energy less the work of the
touches is, but for a constant, Π = ½ yᵀ A y + ½ |s|² of the unknowns y = (q, c): the load has gone,
because the linear solutions g balance it. s_m = ½ zᵀ B_m z with z = (q, F, c).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe.arrays import F64, I64
from fe.linear.energy_minimum import min_energy_fraction
from fe.reduced.assembly import Assembled
from fe.reduced.forms import Forms
from fe.reduced.kernel import slopes, slopes_by, stretch, summed, values_by, whole

_ITERATIONS = 30
# Residual, in parts of the force that the linear solution puts on the fixed shapes. One more step
# leaves its square, and derivatives are off by this much.
_SETTLED = 1e-7
# A balance leads to another if places differ by less, in parts of the plate's shorter side, and
# forces by less, in parts of the later ones.
_NEAR, _STRONGER = 0.06, 0.5


class Balance(NamedTuple):
    """State of the reduced plate, and its derivatives by x, y, F of each touch in turn.

    Attributes
    ----------
    weights : (n + t,) float64
        z: q, then F and c of each touch.
    stress : (M,) float64
    drift : (U,) float64
    weights_by, stress_by, drift_by : (n + t, 3 T), (M, 3 T), (U, 3 T) float64
    converged : bool
    """

    weights: F64
    stress: F64
    drift: F64
    weights_by: F64
    stress_by: F64
    drift_by: F64
    converged: bool


class Settled(NamedTuple):
    """A balance, and the touches that it holds.

    Attributes
    ----------
    xy : (T, 2) float64, mm
    force : (T,) float64, N
    radius : (T,) float64, mm
    balance : Balance
    """

    xy: F64
    force: F64
    radius: F64
    balance: Balance

    def leading_to(self, xy: F64, force: F64, radius: F64, side: float) -> F64 | None:
        """Weights under touches near by, to first order; None where they are not near.

        `side` is the shorter one of the plate, mm.
        """
        if self.xy.shape != xy.shape or not np.array_equal(self.radius, radius):
            return None
        moved, pressed = xy - self.xy, force - self.force
        far = np.abs(moved).max() > _NEAR * side
        if far or (np.abs(pressed) > _STRONGER * np.abs(force)).any() or not self.balance.converged:
            return None
        return (
            self.balance.weights
            + self.balance.weights_by @ np.column_stack([moved, pressed]).ravel()
        )


class _Point(NamedTuple):
    """Energy at one z, with its derivatives; the gradient is by all but the forces."""

    weights: F64
    stress: F64
    slope: F64
    gradient: F64
    hessian: F64
    tense: F64
    left: F64


def balance(forms: Forms, assembled: Assembled, force: F64, begun: F64 | None = None) -> Balance:
    """Find the balance under forces (T,) N by Newton's method, and its derivatives.

    It begins at weights near by where some are given.
    """
    n, split, functions = forms.fixed.shape[1], forms.stresses, assembled.projected.shape[2]
    pushed = n + functions * np.arange(len(force))
    held = np.concatenate([forms.resting, pushed])
    point, converged = _descend(forms, assembled, force, held, begun)
    drift_slope, drift_left = slopes(forms.fixed, *assembled, point.weights, 1 + split)
    direct, out = _moved(forms, assembled, point, drift_left, held)
    # First what changes at fixed weights, then the weights follow and keep the balance.
    out[:, 2::3] = point.hessian[:, pushed]
    out[held] = 0.0
    out[pushed, 2 + 3 * np.arange(len(force))] = -1.0
    # The last step is solved beside them, and changes stress and drift along their slopes.
    right = np.column_stack([out, point.gradient])
    solved = np.asarray(np.linalg.solve(_held(point.hessian, held), -right), dtype=np.float64)
    weights_by, step = solved[:, :-1], solved[:, -1]
    slope = np.concatenate([point.slope, drift_slope])
    values_by = direct + slope @ weights_by
    drift = drift_slope @ (0.5 * point.weights + step)
    stress = point.stress + point.slope @ step
    by = weights_by, values_by[:split], values_by[split:]
    return Balance(point.weights + step, stress, drift, *by, converged)


def _descend(
    forms: Forms, assembled: Assembled, force: F64, held: I64, begun: F64 | None
) -> tuple[_Point, bool]:
    """Point of balance, and whether it is one."""
    bending = whole(forms.fixed, *assembled)
    bending[held] = bending[:, held] = 0.0
    pushed = held[len(forms.resting) :]
    size = float(np.linalg.norm(force @ assembled.projected[:, 0, 0]))
    weights = _first(forms, assembled, pushed, force) if begun is None else begun
    for _ in range(_ITERATIONS):
        point = _at(forms, assembled, bending, held, weights)
        if np.linalg.norm(point.gradient) <= _SETTLED * size:
            return point, _stable(forms, _held(point.hessian, held))
        weights = point.weights - np.linalg.solve(_held(point.hessian, held), point.gradient)
    if begun is not None:
        return _descend(forms, assembled, force, held, None)
    return _at(forms, assembled, bending, held, weights), False


def _stable(forms: Forms, hessian: F64) -> bool:
    """Whether the energy is least there; only a plate that is not flat at rest can do else."""
    return not len(forms.resting) or float(np.linalg.eigvalsh(hessian)[0]) > 0.0


def _at(forms: Forms, assembled: Assembled, bending: F64, held: I64, weights: F64) -> _Point:
    slope, stress, tense, tense_rows, left = stretch(
        forms.fixed, *assembled, weights, forms.stresses
    )
    gradient = bending @ weights + stress @ slope
    gradient[held] = 0.0
    hessian = bending + slope.T @ slope + whole(tense, tense_rows, assembled.projected)
    return _Point(weights, stress, slope, gradient, hessian, tense, left)


def _held(hessian: F64, held: I64) -> F64:
    """Hessian that leaves the forces, and the shape at rest, as they are."""
    matrix = hessian.copy()
    matrix[held] = matrix[:, held] = 0.0
    matrix[held, held] = 1.0
    return matrix


def _first(forms: Forms, assembled: Assembled, pushed: I64, force: F64) -> F64:
    """Linear solution w times the t of least energy, on the fixed shapes."""
    n, stresses = forms.fixed.shape[1], slice(1, 1 + forms.stresses)
    weights = np.zeros(n + assembled.projected.shape[2] * len(force))
    weights[pushed] = force
    linear, _ = slopes(forms.fixed, *assembled, weights, 0)
    products = 0.5 * linear @ weights
    work, stretches = 2.0 * float(products[0]), products[stresses]
    stretching, fraction = float(stretches @ stretches), 1.0
    if len(forms.resting):
        bowed = linear[stresses, forms.resting[0]]
        mixed = float(bowed @ stretches)
        fraction = min_energy_fraction(work, float(bowed @ bowed), mixed, stretching)
    elif work > 0 and stretching > 0:
        # U (t - 1) + 2 S t³ = 0, of least energy U (t²/2 - t) + S t⁴/2.
        p = np.sqrt(work / (6.0 * stretching))
        fraction = 2.0 * p * np.sinh(np.arcsinh(1.5 / p) / 3.0)
    weights[:n] = (fraction - 1.0) * linear[0, :n]
    weights[forms.resting] = 1.0
    return weights


def _moved(
    forms: Forms, assembled: Assembled, point: _Point, drift_left: F64, held: I64
) -> tuple[F64, F64]:
    """Change with the places of touches, at fixed weights.

    Returns
    -------
    values : (M + U, 3 T) float64
        Of the stresses and drifts; nothing in the columns of forces.
    gradient : (n + t, 3 T) float64
        Of the gradient of the energy.
    """
    (rows, projected), split = assembled, forms.stresses
    touches, size = len(rows), len(point.weights)
    values = np.zeros((len(forms.fixed) - 1, touches, 3))
    values[:split, :, :2] = values_by(rows, projected, point.weights, point.left, 1)
    values[split:, :, :2] = values_by(rows, projected, point.weights, drift_left, 1 + split)
    gradient = np.zeros((size, touches, 3))
    free = point.weights.copy()
    free[held] = 0.0
    bent = slopes_by(forms.fixed, rows, projected, free)
    bent[held] = 0.0
    pulled = slopes_by(point.tense, summed(rows, point.stress), projected, point.weights)
    stretched = point.slope.T @ values[:split].reshape(split, -1)
    gradient[..., :2] = bent + pulled + stretched.reshape(size, touches, 3)[..., :2]
    return values.reshape(-1, 3 * touches), gradient.reshape(size, -1)

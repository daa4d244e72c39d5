"""Balance of the reduced plate under touches, and how it moves with them.

The deflection is w = Σ_t [F_t g_t + Σ_k c_tk h_tk] + Σ_j q_j φ_j. Its energy less the work of the
touches is, but for a constant, Π = ½ yᵀ A y + ½ |s|² of the unknowns y = (q, c): the load has gone,
because the linear solutions g balance it. s_m = ½ zᵀ B_m z with z = (q, F, c).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe.arrays import F32, F64, I64
from fe.linear.energy_minimum import min_energy_fraction
from fe.reduced.assembly import Assembled
from fe.reduced.forms import Forms
from fe.reduced.kernel import slopes, stretch

_Parts = tuple[F32, F64, F64]  # fixed, mixed and local forms

_ITERATIONS = 30
# Residual, in parts of the force that the linear solution puts on the fixed shapes. One more step
# leaves its square, and derivatives are off by this much.
_SETTLED = 1e-8


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


class _Point(NamedTuple):
    """Energy at one z, with its derivatives; the gradient is by all but the forces."""

    weights: F64
    stress: F64
    slope: F64
    gradient: F64
    hessian: F64


def balance(forms: Forms, assembled: Assembled, force: F64) -> Balance:
    """Find the balance under forces (T,) N by Newton's method, and its derivatives."""
    n, split = forms.fixed.shape[1], forms.stresses
    pushed = n + assembled.functions * np.arange(len(force))
    held = np.concatenate([forms.resting, pushed])
    point, converged = _descend(forms, assembled, force, held)
    # First what changes at fixed weights, then the weights follow and keep the balance.
    direct, out = _moved(assembled, point, held)
    out[:, 2::3] = point.hessian[:, pushed]
    out[held] = 0.0
    out[pushed, 2 + 3 * np.arange(len(force))] = -1.0
    # The last step is solved beside them, and changes the stress along its slope.
    right = np.column_stack([out, point.gradient])
    solved = np.asarray(np.linalg.solve(_held(point.hessian, held), -right), dtype=np.float64)
    weights_by, step = solved[:, :-1], solved[:, -1]
    weights, stress = point.weights + step, point.stress + point.slope @ step
    drift_slope = slopes(*_parts(forms, assembled, slice(1 + split, None)), weights)
    values_by = direct + np.concatenate([point.slope, drift_slope]) @ weights_by
    by = weights_by, values_by[:split], values_by[split:]
    return Balance(weights, stress, 0.5 * drift_slope @ weights, *by, converged)


def _descend(forms: Forms, assembled: Assembled, force: F64, held: I64) -> tuple[_Point, bool]:
    """Point of balance, and whether it is one."""
    bending = _bending(assembled, held)
    parts = _parts(forms, assembled, slice(1, 1 + forms.stresses))
    pushed = held[len(forms.resting) :]
    size = np.linalg.norm(assembled.mixed[0][:, pushed - forms.fixed.shape[1]] @ force)
    point = _at(parts, bending, held, _first(forms, assembled, pushed, force))
    for _ in range(_ITERATIONS):
        left = point.gradient
        if np.linalg.norm(left) <= _SETTLED * size:
            return point, _stable(forms, _held(point.hessian, held))
        weights = point.weights - np.linalg.solve(_held(point.hessian, held), left)
        point = _at(parts, bending, held, weights)
    return point, False


def _stable(forms: Forms, hessian: F64) -> bool:
    """Whether the energy is least there; only a plate that is not flat at rest can do else."""
    return not len(forms.resting) or float(np.linalg.eigvalsh(hessian)[0]) > 0.0


def _at(parts: _Parts, bending: F64, held: I64, weights: F64) -> _Point:
    slope, stress, tense = stretch(*parts, weights)
    gradient = bending @ weights + stress @ slope
    gradient[held] = 0.0
    return _Point(weights, stress, slope, gradient, bending + tense + slope.T @ slope)


def _held(hessian: F64, held: I64) -> F64:
    """Hessian that leaves the forces, and the shape at rest, as they are."""
    matrix = hessian.copy()
    matrix[held] = matrix[:, held] = 0.0
    matrix[held, held] = 1.0
    return matrix


def _parts(forms: Forms, assembled: Assembled, which: slice) -> _Parts:
    mixed = np.ascontiguousarray(assembled.mixed[which].swapaxes(1, 2))
    return forms.fixed[which], mixed, assembled.local[which]


def _bending(assembled: Assembled, held: I64) -> F64:
    """Bending energy on (n + t) weights, without the forces, whose part balances the load."""
    mixed, local = assembled.mixed[0], assembled.local[0]
    n, t = mixed.shape
    matrix = np.eye(n + t)
    matrix[:n, n:], matrix[n:, :n], matrix[n:, n:] = mixed, mixed.T, local
    matrix[held] = matrix[:, held] = 0.0
    return matrix


def _first(forms: Forms, assembled: Assembled, pushed: I64, force: F64) -> F64:
    """Linear solution w times the t of least energy, on the fixed shapes."""
    n, stresses = forms.fixed.shape[1], slice(1, 1 + forms.stresses)
    linear = np.zeros(assembled.local.shape[1])
    linear[pushed - n] = force
    products = 0.5 * assembled.local @ linear @ linear
    work, stretches = 2.0 * products[0], products[stresses]
    stretching, fraction = float(stretches @ stretches), 1.0
    if len(forms.resting):
        bowed = assembled.mixed[stresses, forms.resting[0]] @ linear
        mixed = float(bowed @ stretches)
        fraction = min_energy_fraction(work, float(bowed @ bowed), mixed, stretching)
    elif work > 0 and stretching > 0:
        # U (t - 1) + 2 S t³ = 0, of least energy U (t²/2 - t) + S t⁴/2.
        p = np.sqrt(work / (6.0 * stretching))
        fraction = 2.0 * p * np.sinh(np.arcsinh(1.5 / p) / 3.0)
    fixed = (fraction - 1.0) * (assembled.mixed[0] @ linear)
    fixed[forms.resting] = 1.0
    return np.concatenate([fixed, linear])


def _moved(assembled: Assembled, point: _Point, held: I64) -> tuple[F64, F64]:
    """Change with the places of touches, at fixed weights.

    Returns
    -------
    values : (M + U, 3 T) float64
        Of the stresses and drifts; nothing in the columns of forces.
    gradient : (n + t, 3 T) float64
        Of the gradient of the energy.
    """
    n, (touches, _, count) = assembled.mixed.shape[1], assembled.mixed_by.shape[:3]
    q, tau = np.split(point.weights, [n])
    stresses = len(point.stress)
    moved = _slopes_by(assembled.mixed_by, assembled.local_by, q, tau)
    changes = 0.5 * moved[:, :, 1:] @ point.weights
    tense = tau.copy()
    tense[held[held >= n] - n] = 0.0
    bent = _slopes_by(assembled.mixed_by[:, :, 0], assembled.local_by[:, :, 0], q, tense)
    bent[:, :, held] = 0.0
    stressed = point.stress @ moved[:, :, 1 : 1 + stresses] + changes[..., :stresses] @ point.slope
    values = np.zeros((count - 1, touches, 3))
    values[..., :2] = np.moveaxis(changes, 2, 0)
    gradient = np.zeros((len(point.weights), touches, 3))
    gradient[..., :2] = np.moveaxis(bent + stressed, 2, 0)
    return values.reshape(count - 1, -1), gradient.reshape(len(point.weights), -1)


def _slopes_by(mixed: F64, local: F64, q: F64, tau: F64) -> F64:
    """Differentiate B z by the places of touches, (T, 2, ..., n + t)."""
    return np.concatenate([mixed @ tau, q @ mixed + local @ tau], axis=-1)

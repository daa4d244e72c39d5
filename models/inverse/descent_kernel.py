"""The loop of Levenberg and Marquardt, compiled for tables and plain for other forward models."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from models.arrays import F64
from models.compiled import njit, overload
from models.forward.linear import Forward
from models.forward.table import ForwardTable, read_touches
from models.inverse.normal_equations import (
    active_bounds,
    assemble,
    clipped_step,
    damped_step,
    fisher_matrix,
    inverse,
)
from models.inverse.prior import Prior

MIN_DAMPING = 1e-12
SINGULAR = 1e-14  # of the Fisher matrix of unit diagonal: less is what rounding leaves


class Control(NamedTuple):
    """The fields of `LevenbergMarquardt`, as compiled code takes them."""

    max_steps: int
    damping: float
    damping_down: float
    damping_up: float
    max_damping: float
    tolerance: float


def descend(
    model: Any,
    measured: F64,
    touches: F64,
    bounds: F64,
    prior: Prior,
    control: Control,
    relative_tolerance: float,
) -> tuple[F64, F64, F64, float, bool, int, int]:
    """Run the loop; in the part of NumPy that numba compiles. `model` is a Forward or a table.

    Returns
    -------
    touches, residual, jacobian, chi2, converged, steps, evaluations
        As `Fit` has them.
    """
    mean, precision = prior
    max_steps, damping, damping_down, damping_up, max_damping, tolerance = control
    touches = clipped_step(touches, np.zeros(touches.size), bounds)
    predicted, jacobian = _read(model, touches)
    residual = measured - predicted
    cost = float(residual @ residual) + _prior_cost(touches, mean, precision)
    evaluations = 1
    for steps in range(1, max_steps + 1):
        normal, slope = assemble(jacobian, residual, touches, mean, precision)
        held = active_bounds(touches, slope, bounds)
        trial = clipped_step(touches, damped_step(normal, slope, held, damping), bounds)
        step = (trial - touches).ravel()
        promise = float(step @ (2.0 * slope - normal @ step))
        if damping < 1.0 and 0 <= promise < tolerance:
            # The last step is so short that what it leaves need not be read again.
            return trial, residual - step @ jacobian, jacobian, cost, True, steps, evaluations
        predicted, trial_jacobian = _read(model, trial)
        evaluations += 1
        trial_residual = measured - predicted
        trial_cost = float(trial_residual @ trial_residual) + _prior_cost(trial, mean, precision)
        fall = cost - trial_cost
        if fall < 0 or promise <= 0:
            damping *= damping_up
            if damping > max_damping:
                return touches, residual, jacobian, cost, True, steps, evaluations
            continue
        touches, residual, jacobian, cost = trial, trial_residual, trial_jacobian, trial_cost
        # What is held back by its damping falls little.
        if fall < max(tolerance, relative_tolerance * cost) and damping < 1.0:
            return touches, residual, jacobian, cost, True, steps, evaluations
        surplus = min(2.0 * fall / promise - 1.0, 1.0)
        damping = max(damping * min(max(1.0 - surplus**3, damping_down), 1.0), MIN_DAMPING)
    return touches, residual, jacobian, cost, False, max_steps, evaluations


_descend_table = njit(cache=True, nogil=True)(descend)


@njit(cache=True, nogil=True)
def descend_table(
    table: ForwardTable,
    measured: F64,
    touches: F64,
    bounds: F64,
    prior: Prior,
    control: Control,
    relative_tolerance: float,
) -> tuple[F64, F64, F64, float, bool, int, int, F64]:
    """Descend and say how sure what is found is, in one call."""
    touches, residual, jacobian, cost, converged, steps, evaluations = _descend_table(
        table, measured, touches, bounds, prior, control, relative_tolerance
    )
    spread = inverse_fisher(jacobian, prior.precision)
    return touches, residual, jacobian, cost, converged, steps, evaluations, spread


@njit(cache=True, nogil=True)
def _prior_cost(touches: F64, mean: F64, precision: F64) -> float:
    """Sum of squares by which touches (n, 3) lie off what is expected of them."""
    total = 0.0
    for touch in touches:
        for c in range(3):
            total += precision[c] * (mean[c] - touch[c]) ** 2
    return total


def _read(model: Forward, touches: F64) -> tuple[F64, F64]:
    return model.read(touches)


@overload(_read)
def _compile_read(model: Any, touches: Any) -> Callable[[Any, Any], Any]:
    """In compiled code the model is a `ForwardTable`."""

    def read(model: Any, touches: Any) -> Any:  # of the same signature, or numba refuses it
        return read_touches(model, touches)

    return read


@njit(cache=True, nogil=True)
def inverse_fisher(jacobian: F64, precision: F64) -> F64:
    """Covariance (3n, 3n) of touches by a jacobian (3n, m) and the precision (3,) of a prior."""
    fisher = fisher_matrix(jacobian, precision)
    scale = np.empty(len(fisher))
    for k in range(len(fisher)):
        scale[k] = 1.0 / np.sqrt(max(fisher[k, k], 1e-200))
    for k in range(len(fisher)):
        fisher[k] *= scale[k] * scale
    spread = inverse(fisher, SINGULAR)
    for k in range(len(fisher)):
        spread[k] *= scale[k] * scale
    return spread


@njit(cache=True, nogil=True)
def weak_or_close(touches: F64, spread: F64) -> tuple[int, float, int, int, float]:
    """Touch (of n, 3) that is least sure to be there, and two that are least sure to be two.

    Returns
    -------
    weakest : int
    evidence : float
        Its force over the standard deviation of that, squared.
    i, j : int
        Indices of two touches, i < j.
    apart : float
        Squared number of standard deviations between their places; infinite for less than two.
    """
    weakest, evidence = 0, np.inf
    first, second, nearest = 0, 0, np.inf
    for j in range(len(touches)):
        known = touches[j, 2] ** 2 / spread[3 * j + 2, 3 * j + 2]
        if known < evidence:
            weakest, evidence = j, known
        for i in range(j):
            a, b = 3 * i, 3 * j
            dx, dy = touches[i, 0] - touches[j, 0], touches[i, 1] - touches[j, 1]
            xx = spread[a, a] + spread[b, b] - 2 * spread[a, b]
            yy = spread[a + 1, a + 1] + spread[b + 1, b + 1] - 2 * spread[a + 1, b + 1]
            xy = spread[a, a + 1] + spread[b, b + 1] - spread[a, b + 1] - spread[a + 1, b]
            squared = yy * dx**2 - 2 * xy * dx * dy + xx * dy**2
            squared /= max(xx * yy - xy**2, 1e-300)
            if squared < nearest:
                first, second, nearest = i, j, squared
    return weakest, evidence, first, second, nearest


@njit(cache=True, nogil=True)
def sort_touches(touches: F64, spread: F64) -> tuple[F64, F64]:
    """Sort touches (n, 3) and their covariance (3n, 3n) by x, then by y."""
    rows = np.arange(len(spread)).reshape(-1, 3)
    for end in range(1, len(touches)):
        for k in range(end, 0, -1):
            before, after = touches[rows[k - 1, 0] // 3], touches[rows[k, 0] // 3]
            if (before[0], before[1]) <= (after[0], after[1]):
                break
            for c in range(3):
                rows[k - 1, c], rows[k, c] = rows[k, c], rows[k - 1, c]
    order = rows.ravel()
    return touches[order[::3] // 3], spread[order][:, order]

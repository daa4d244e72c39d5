"""Least squares on a forward model: Levenberg-Marquardt on x, y, F of every touch.

After Marquardt (1963), damped as by Nielsen (1999), with the exact Jacobian; places stay on the
plate and forces push. One loop serves all forward models: compiled for those that are linear in
force, as it stands for others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import overload
from numpy.typing import NDArray

from models.forward.linear import Forward, LinearForward
from models.forward.table import read_touches
from models.inverse.normal_equations import (
    active_bounds,
    assemble,
    clipped_step,
    damped_step,
    fisher_matrix,
    inverse,
)
from models.inverse.prior import FLAT, Prior

STEPS = 300  # at most; five are usual, a hundred where touches are hard to tell apart
# Damping falls by so much where a step brought what it promised, and not at all where it brought
# half of that: otherwise every other step through a narrow valley fails. It rises by `MORE`.
LESS, MORE = 0.2, 3.0
STUCK = 1e8  # damping at which only rounding keeps χ² from falling
SETTLED = 1e-6  # fall of χ² below which a fit has settled: a thousandth of a standard deviation
SINGULAR = 1e-14  # of the Fisher matrix of unit diagonal: less is what rounding leaves


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
        Sum of squares of the residual and of what priors pull.
    settled : bool
        Whether no step would lower χ² by more than `SETTLED`, or a coarse fit's share of it.
    spread : (3n, 3n) float64, mm and N
        Covariance of x1, y1, F1, x2, …: see `covariance`.
    """

    touches: NDArray[np.float64]
    residual: NDArray[np.float64]
    jacobian: NDArray[np.float64]
    chi2: float
    settled: bool
    spread: NDArray[np.float64]


def descend(
    measured: NDArray,
    forward: Forward,
    touches: NDArray,
    bounds: NDArray,
    prior: Prior = FLAT,
    share: float = 0.0,
) -> Fit:
    """Touches of least χ² that lie downhill of `touches`.

    Parameters
    ----------
    measured : (m,) float64
        In units of its noise.
    forward : Forward
    touches : (n, 3) float64, mm, mm, N
        x, y, F to start from.
    bounds : (2, 3) float64, mm, mm, N
        Least and largest x, y, F that a touch may take.
    prior : Prior
    share : float
        Of χ² by which a step must lower it to be worth another; 0 to settle for nothing but the
        least.
    """
    if isinstance(forward, LinearForward):
        return Fit(*_compiled(forward.table, measured, touches, bounds, *prior, share))
    fit = _descend(forward, measured, touches, bounds, *prior, share)
    return Fit(*fit, covariance(fit[2], prior.precision))


def covariance(jacobian: NDArray, precision: NDArray = FLAT.precision) -> NDArray[np.float64]:
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
    return _inverse_fisher(jacobian, precision)


@njit(cache=True, nogil=True)
def _pull(touches: NDArray, mean: NDArray, precision: NDArray) -> float:
    """Sum of squares of what priors pull at touches (n, 3)."""
    total = 0.0
    for touch in touches:
        for c in range(3):
            total += precision[c] * (mean[c] - touch[c]) ** 2
    return total


def _read(model: Forward, touches: NDArray) -> tuple[NDArray, NDArray]:
    return model.read(touches)


@overload(_read)
def _compile_read(model, touches):
    """In compiled code the model is a `Table`."""
    return lambda model, touches: read_touches(model, touches)


def _descend(
    model, measured: NDArray, touches: NDArray, bounds: NDArray, mean, precision, share: float
) -> tuple[NDArray, NDArray, NDArray, float, bool]:
    """Run the loop; in the part of NumPy that numba compiles. `model` is a Forward or a Table."""
    damping = 1e-4
    touches = clipped_step(touches, np.zeros(touches.size), bounds)
    predicted, jacobian = _read(model, touches)
    residual = measured - predicted
    cost = float(residual @ residual) + _pull(touches, mean, precision)
    for _ in range(STEPS):
        normal, slope = assemble(jacobian, residual, touches, mean, precision)
        held = active_bounds(touches, slope, bounds)
        trial = clipped_step(touches, damped_step(normal, slope, held, damping), bounds)
        step = (trial - touches).ravel()
        promise = float(step @ (2.0 * slope - normal @ step))
        if damping < 1.0 and 0 <= promise < SETTLED:
            # The last step is so short that what it leaves need not be read again.
            return trial, residual - step @ jacobian, jacobian, cost, True
        predicted, trial_jacobian = _read(model, trial)
        left = measured - predicted
        trial_cost = float(left @ left) + _pull(trial, mean, precision)
        fall = cost - trial_cost
        if fall < 0 or promise <= 0:
            damping *= MORE
            if damping > STUCK:
                return touches, residual, jacobian, cost, True
            continue
        touches, residual, jacobian, cost = trial, left, trial_jacobian, trial_cost
        if fall < max(SETTLED, share * cost) and damping < 1.0:  # what is held back falls little
            return touches, residual, jacobian, cost, True
        surplus = min(2.0 * fall / promise - 1.0, 1.0)
        damping = max(damping * min(max(1.0 - surplus**3, LESS), 1.0), 1e-12)
    return touches, residual, jacobian, cost, False


_descend_table = njit(cache=True, nogil=True)(_descend)


@njit(cache=True, nogil=True)
def _compiled(table, measured, touches, bounds, mean, precision, share):
    """Descend and say how sure what is found is, in one call."""
    touches, residual, jacobian, cost, settled = _descend_table(
        table, measured, touches, bounds, mean, precision, share
    )
    return touches, residual, jacobian, cost, settled, _inverse_fisher(jacobian, precision)


@njit(cache=True, nogil=True)
def _inverse_fisher(jacobian: NDArray, precision: NDArray) -> NDArray:
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
def weak_or_close(touches: NDArray, spread: NDArray) -> tuple[int, float, int, int, float]:
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
    first, second, least = 0, 0, np.inf
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
            if squared < least:
                first, second, least = i, j, squared
    return weakest, evidence, first, second, least


@njit(cache=True, nogil=True)
def sort_touches(touches: NDArray, spread: NDArray) -> tuple[NDArray, NDArray]:
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

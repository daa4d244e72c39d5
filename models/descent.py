"""Least squares on a forward model: Levenberg-Marquardt on x, y, F of every touch.

After Marquardt (1963), with the exact Jacobian; places stay on the plate and forces push. One loop
serves all forward models: compiled for those that are linear in force, as it stands for others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import overload
from numpy.typing import NDArray

from models.forward import Forward, LinearForward
from models.knowledge import FLAT, Prior
from models.table import read_touches

STEPS = 200  # at most; five are usual, and forty where two touches are hard to tell apart
# Damping falls by more than it rises: equal factors tread from side to side of a narrow valley.
LESS, MORE = 0.2, 3.0
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
    """

    touches: NDArray[np.float64]
    residual: NDArray[np.float64]
    jacobian: NDArray[np.float64]
    chi2: float


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
    return Fit(*_descend(forward, measured, touches, bounds, *prior, share))


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


def _read(model: Forward, touches: NDArray) -> tuple[NDArray, NDArray]:
    return model.read(touches)


@overload(_read)
def _compile_read(model, touches):
    """In compiled code the model is a `Table`."""
    return lambda model, touches: read_touches(model, touches)


def _descend(
    model, measured: NDArray, touches: NDArray, bounds: NDArray, mean, precision, share: float
):
    """Run the loop; in the part of NumPy that numba compiles. `model` is a Forward or a Table."""
    damping, low, high = 1e-4, bounds[0], bounds[1]
    touches = np.minimum(np.maximum(touches, low), high)
    predicted, jacobian = _read(model, touches)
    residual = measured - predicted
    away = mean - touches
    cost = residual @ residual + (precision * away**2).sum()
    stiff = np.zeros_like(touches)
    stiff += precision
    stiff = stiff.ravel()
    for _ in range(STEPS):
        normal = jacobian @ jacobian.T + np.diag(stiff)
        slope = jacobian @ residual + (precision * away).ravel()
        diagonal = np.diag(normal)
        ridge = np.diag(damping * np.where(diagonal > 0, diagonal, 1.0))
        step = np.linalg.solve(normal + ridge, slope)
        trial = np.minimum(np.maximum(touches + step.reshape(touches.shape), low), high)
        if damping < 1.0 and step @ slope < SETTLED:
            # The last step is so short that what it leaves need not be read again.
            residual = residual - (trial - touches).ravel() @ jacobian
            touches = trial
            break
        predicted, trial_jacobian = _read(model, trial)
        left, trial_away = measured - predicted, mean - trial
        trial_cost = left @ left + (precision * trial_away**2).sum()
        fall = cost - trial_cost
        if fall < 0:
            damping *= MORE
            if damping > 1e8:
                break
            continue
        enough = max(SETTLED, share * cost)
        settled = fall < enough and damping < 1.0  # a step that is held back falls little anyway
        touches, residual, jacobian = trial, left, trial_jacobian
        away, cost = trial_away, trial_cost
        damping = max(LESS * damping, 1e-12)
        if settled:
            break
    return touches, residual, jacobian, cost


_compiled = njit(cache=True, nogil=True)(_descend)


@njit(cache=True, nogil=True)
def _inverse_fisher(jacobian: NDArray, precision: NDArray) -> NDArray:
    count = len(jacobian)
    fisher = jacobian @ jacobian.T
    for k in range(count):
        fisher[k, k] += precision[k % 3]
    scale = np.sqrt(np.maximum(np.diag(fisher), 1e-200))
    values, vectors = np.linalg.eigh(fisher / np.outer(scale, scale))
    return (vectors / np.maximum(values, SINGULAR)) @ vectors.T / np.outer(scale, scale)


@njit(cache=True, nogil=True)
def least_apart(touches: NDArray, spread: NDArray) -> tuple[int, int, float]:
    """Two touches (of n, 3) whose places differ least, by their covariance (3n, 3n).

    Returns
    -------
    i, j : int
        Their indices, i < j.
    squared : float
        Squared number of standard deviations between them; infinite for less than two touches.
    """
    first, second, least = 0, 0, np.inf
    for j in range(len(touches)):
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
    return first, second, least

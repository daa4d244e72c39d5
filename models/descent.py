"""Least squares on a forward model: Levenberg-Marquardt on x, y, F of every touch.

After Marquardt (1963), with the exact Jacobian; places stay on the plate and forces push.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from models.forward import Forward

STEPS = 100  # at most; five are usual
SETTLED = 1e-6  # fall of χ² below which a fit has settled: a thousandth of a standard deviation
SINGULAR = 1e-14  # of the Fisher matrix of unit diagonal: less is what rounding leaves


def predict(forward: Forward, touches: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Measurement under touches (n, 3), (m,), and its derivative in x1, y1, F1, x2, …, (m, 3n)."""
    response = forward.response(touches[:, :2])
    gradient = forward.gradient(touches[:, :2]) * touches[:, 2, None, None]
    columns = np.concatenate([gradient, response[:, :, None]], axis=2)  # (n, m, 3)
    jacobian = columns.transpose(1, 0, 2).reshape(response.shape[1], touches.size)
    return touches[:, 2] @ response, jacobian


def chi2(measured: NDArray, forward: Forward, touches: NDArray) -> float:
    """Sum of squares that touches (n, 3) leave of a whitened measurement (m,)."""
    left = measured - touches[:, 2] @ forward.response(touches[:, :2])
    return float(left @ left)


def descend(
    measured: NDArray, forward: Forward, touches: NDArray, bounds: NDArray
) -> NDArray[np.float64]:
    """Touches (n, 3) of least χ² that lie downhill of `touches`.

    Parameters
    ----------
    measured : (m,) float64
        In units of its noise.
    forward : Forward
    touches : (n, 3) float64, mm, mm, N
        x, y, F to start from.
    bounds : (2, 2) float64, mm
        Lower and upper corner of the places that a touch may take; forces stay 0 or more.
    """
    damping, (predicted, jacobian) = 1e-4, predict(forward, touches)
    residual = measured - predicted
    for _ in range(STEPS):
        normal, slope = jacobian.T @ jacobian, jacobian.T @ residual
        ridge = np.diag(damping * np.diag(normal).clip(1e-300))
        trial = touches + np.linalg.solve(normal + ridge, slope).reshape(-1, 3)
        trial[:, :2] = np.clip(trial[:, :2], *bounds)
        trial[:, 2] = trial[:, 2].clip(0.0)
        predicted, trial_jacobian = predict(forward, trial)
        left = measured - predicted
        fall = residual @ residual - left @ left
        if fall < 0:
            damping *= 10.0
            if damping > 1e8:
                break
            continue
        settled = fall < SETTLED and damping < 1.0  # a step that is held back falls little anyway
        touches, residual, jacobian = trial, left, trial_jacobian
        damping = max(damping / 10.0, 1e-12)
        if settled:
            break
    return touches


def covariance(forward: Forward, touches: NDArray) -> NDArray[np.float64]:
    """Inverse Fisher matrix of x, y, F of each touch, (3n, 3n) mm and N.

    Where the measurement says nothing the variance is finite and huge, so that the other touches
    keep theirs.
    """
    jacobian = predict(forward, touches)[1]
    fisher = jacobian.T @ jacobian
    scale = np.sqrt(np.diag(fisher).clip(1e-200))
    values, vectors = np.linalg.eigh(fisher / np.outer(scale, scale))
    return (vectors / values.clip(SINGULAR)) @ vectors.T / np.outer(scale, scale)

"""Normal equations of a dozen unknowns or fewer, compiled: calls of LAPACK would take longer."""

from __future__ import annotations

import numpy as np

from models.arrays import F64, Mask
from models.compiled import njit

# Smallest pivot in parts of its diagonal: what is less is rounding.
ROUNDING = 1e-15


@njit(cache=True, nogil=True, fastmath=True)
def fisher_matrix(jacobian: F64, precision: F64) -> F64:
    """Fisher matrix (3n, 3n) of a whitened measurement, jacobian (3n, m), and of a prior (3,)."""
    fisher = np.empty((len(jacobian), len(jacobian)))
    for i in range(len(jacobian)):
        for j in range(i + 1):
            total = 0.0
            for k in range(jacobian.shape[1]):
                total += jacobian[i, k] * jacobian[j, k]
            fisher[i, j] = fisher[j, i] = total
        fisher[i, i] += precision[i % 3]
    return fisher


@njit(cache=True, nogil=True)
def assemble(
    jacobian: F64, residual: F64, touches: F64, mean: F64, precision: F64
) -> tuple[F64, F64]:
    """Fisher matrix (3n, 3n), and the slope (3n,) of -χ²/2, of touches (n, 3) with a prior."""
    slope = jacobian @ residual
    for i in range(len(slope)):
        slope[i] += precision[i % 3] * (mean[i % 3] - touches[i // 3, i % 3])
    return fisher_matrix(jacobian, precision), slope


@njit(cache=True, nogil=True)
def active_bounds(touches: F64, slope: F64, bounds: F64) -> Mask:
    """Unknowns (3n,) that would leave their bounds: they would bend the step of all others."""
    held = np.empty(len(slope), dtype=np.bool_)
    for i in range(len(slope)):
        value, c = touches[i // 3, i % 3], i % 3
        held[i] = (value <= bounds[0, c] and slope[i] < 0) or (
            value >= bounds[1, c] and slope[i] > 0
        )
    return held


@njit(cache=True, nogil=True)
def clipped_step(touches: F64, step: F64, bounds: F64) -> F64:
    """Touches (n, 3) after a step (3n,), as far as their bounds let them."""
    after = np.empty_like(touches)
    for i in range(len(touches)):
        for c in range(3):
            after[i, c] = min(max(touches[i, c] + step[3 * i + c], bounds[0, c]), bounds[1, c])
    return after


@njit(cache=True, nogil=True)
def factorise(matrix: F64) -> float:
    """Put the lower Cholesky factor of a symmetric matrix (n, n) in its place.

    Returns
    -------
    float
        Smallest pivot in parts of its diagonal; those below `ROUNDING` are held there.
    """
    smallest = 1.0
    for j in range(len(matrix)):
        diagonal = matrix[j, j]
        pivot = diagonal
        for k in range(j):
            pivot -= matrix[j, k] ** 2
        root = 1.0  # of what is never measured
        smallest = min(smallest, pivot / diagonal if diagonal > 0 else 0.0)
        if diagonal > 0:
            root = np.sqrt(max(pivot, ROUNDING * diagonal))
        matrix[j, j] = root
        for i in range(j + 1, len(matrix)):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = total / root
            matrix[j, i] = 0.0
    return smallest


@njit(cache=True, nogil=True)
def damped_step(normal: F64, slope: F64, held: Mask, damping: float) -> F64:
    """Solve (N + damping diag N) step = slope for the unknowns that are not held (n,)."""
    matrix, step = normal.copy(), slope.copy()
    for i in range(len(step)):
        matrix[i, i] += damping * matrix[i, i]
        if held[i] or not matrix[i, i] > 0:
            matrix[i], matrix[:, i], step[i] = 0.0, 0.0, 0.0
            matrix[i, i] = 1.0
    factorise(matrix)
    for i in range(len(step)):
        for k in range(i):
            step[i] -= matrix[i, k] * step[k]
        step[i] /= matrix[i, i]
    for i in range(len(step) - 1, -1, -1):
        for k in range(i + 1, len(step)):
            step[i] -= matrix[k, i] * step[k]
        step[i] /= matrix[i, i]
    return step


@njit(cache=True, nogil=True)
def inverse(matrix: F64, smallest: float) -> F64:
    """Invert a symmetric matrix (n, n) of unit diagonal whose eigenvalues are not negative.

    Eigenvalues below `smallest` count as `smallest`, so that what is known of nothing stays finite.
    """
    lower = matrix.copy()
    if not factorise(lower) > 1e-8:
        values, vectors = np.linalg.eigh(matrix)
        return (vectors / np.maximum(values, smallest)) @ vectors.T
    for j in range(len(lower)):
        lower[j, j] = 1.0 / lower[j, j]
        for i in range(j + 1, len(lower)):
            total = 0.0
            for k in range(j, i):
                total -= lower[i, k] * lower[k, j]
            lower[i, j] = total / lower[i, i]
    return lower.T @ lower

"""The inner loops of the balance: each form passes through the cache once."""

from __future__ import annotations

import numpy as np

from fe.arrays import F32, F64
from fe.compiled import njit


@njit(cache=True, nogil=True, fastmath=True)
def slopes(fixed: F32, mixed: F64, local: F64, weights: F64) -> F64:
    """Multiply each form by the weights.

    Parameters
    ----------
    fixed : (M, n, n) float32, symmetric
    mixed : (M, t, n) float64
    local : (M, t, t) float64, symmetric
    weights : (n + t,) float64
        z.

    Returns
    -------
    (M, n + t) float64
        B_m z.
    """
    count, t, n = mixed.shape
    slope = np.empty((count, n + t))
    for m in range(count):
        _multiply(fixed[m], mixed[m], local[m], weights, slope[m])
    return slope


@njit(cache=True, nogil=True, fastmath=True)
def stretch(fixed: F32, mixed: F64, local: F64, weights: F64) -> tuple[F64, F64, F64]:
    """Stretch the plate by its weights, and sum the forms with the stresses that follow.

    Parameters are those of `slopes`.

    Returns
    -------
    slope : (M, n + t) float64
        B_m z.
    stress : (M,) float64
        s_m = ½ zᵀ B_m z.
    tense : (n + t, n + t) float64
        Σ s_m B_m.
    """
    count, t, n = mixed.shape
    slope, stress = np.empty((count, n + t)), np.empty(count)
    tense = np.zeros((n + t, n + t))
    for m in range(count):
        _multiply(fixed[m], mixed[m], local[m], weights, slope[m])
        stress[m] = 0.5 * np.sum(slope[m] * weights)
        _add(stress[m], fixed[m], tense, 0, 0)
        _add(stress[m], mixed[m], tense, n, 0)
        _add(stress[m], local[m], tense, n, n)
    tense[:n, n:] = tense[n:, :n].T
    return slope, stress, tense


@njit(cache=True, nogil=True, fastmath=True)
def _multiply(fixed: F32, mixed: F64, local: F64, weights: F64, out: F64) -> None:
    t, n = mixed.shape
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += fixed[i, j] * weights[j]
        out[i] = total
    for i in range(t):
        z, total = weights[n + i], 0.0
        for j in range(n):
            total += mixed[i, j] * weights[j]
            out[j] += mixed[i, j] * z
        for j in range(t):
            total += local[i, j] * weights[n + j]
        out[n + i] = total


@njit(cache=True, nogil=True, fastmath=True)
def _add(scale: float, part: F32 | F64, total: F64, row: int, column: int) -> None:
    """Add a part to a block of the total, which as a whole lies in one piece of memory."""
    rows, columns = part.shape
    for i in range(rows):
        for j in range(columns):
            total[row + i, column + j] += scale * part[i, j]

"""Products of the functions with every stress and drift: each passes through the cache once.

They are read in single precision, half of what would be read otherwise, which takes most of the
time. It is off by 1e-7; sums are of double precision.
"""

from __future__ import annotations

import numpy as np

from fe.arrays import F32, F64
from fe.compiled import njit


@njit(cache=True, nogil=True, fastmath=True)
def pulls(products: F32, weights: F64, first: int, last: int) -> F64:
    """Multiply matrices `first` … `last` - 1 of (R, c, c) by weights (c,), (last - first, c)."""
    size = weights.size
    out = np.empty((last - first, size))
    for r in range(last - first):
        for j in range(size):
            total = 0.0
            for i in range(size):
                total += products[first + r, j, i] * weights[i]
            out[r, j] = total
    return out


@njit(cache=True, nogil=True, fastmath=True)
def summed(packed: F32, scale: F64) -> F64:
    """Sum symmetric matrices, of which lower triangles are given, times their scales: (c, c)."""
    total = np.zeros(packed.shape[1])
    for k in range(0, scale.size - 3, 4):
        a, b, c, d = packed[k], packed[k + 1], packed[k + 2], packed[k + 3]
        p, q, r, s = scale[k], scale[k + 1], scale[k + 2], scale[k + 3]
        for i in range(total.size):
            total[i] += p * a[i] + q * b[i] + r * c[i] + s * d[i]
    for k in range(scale.size - scale.size % 4, scale.size):
        for i in range(total.size):
            total[i] += scale[k] * packed[k, i]
    size = int(np.sqrt(2.0 * total.size))
    matrix, first = np.empty((size, size)), 0
    for i in range(size):
        for j in range(i + 1):
            matrix[i, j] = matrix[j, i] = total[first + j]
        first += i + 1
    return matrix

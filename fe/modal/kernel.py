"""Products of the functions with every stress and drift: each passes through the cache once.

They are symmetric, and kept as lower triangles in single precision: a quarter of what would be read
otherwise, which takes most of the time. That is off by 1e-7; sums are of double precision.
"""

from __future__ import annotations

import numpy as np

from fe.arrays import F32, F64
from fe.compiled import njit


@njit(cache=True, nogil=True, fastmath=True)
def pulls(packed: F32, weights: F64, first: int, last: int) -> F64:
    """Multiply symmetric matrices `first` … `last` - 1 by weights (c,), (last - first, c).

    Two rows of a triangle (R, c (c + 1) / 2) are read at once, each also as a column.
    """
    size = weights.size
    out = np.zeros((last - first, size))
    for r in range(last - first):
        triangle, row, begins = packed[first + r], out[r], 0
        if size % 2:
            row[0] = triangle[0] * weights[0]
            begins = 1
        for j in range(size % 2, size, 2):
            above, below = triangle[begins : begins + j + 1], triangle[begins + j + 1 :]
            p, q, u, v = weights[j], weights[j + 1], 0.0, 0.0
            for i in range(j):
                u += above[i] * weights[i]
                v += below[i] * weights[i]
                row[i] += above[i] * p + below[i] * q
            row[j] = u + above[j] * p + below[j] * q
            row[j + 1] = v + below[j] * p + below[j + 1] * q
            begins += 2 * j + 3
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

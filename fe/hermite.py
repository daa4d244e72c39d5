"""Cubic Hermite functions on a uniform line of elements.

Along one axis a function is held by its value and its slope at each node, the slope times the
element length h so that both have one unit: unknowns (v0, h v0', v1, h v1', ...). Products of two
such lines are the rectangle of Bogner, Fox & Schmit (1965), C1 everywhere; all matrices and all
evaluations on the plate are therefore products of what stands here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numba import njit
from numpy.typing import NDArray


class Stencil(NamedTuple):
    """K linear functionals of the unknowns of one axis, each on a window of w neighbours.

    Attributes
    ----------
    start : (K,) int64
        First unknown of each window.
    weights : (K, w) float64
        Weight of each unknown.
    """

    start: NDArray[np.int64]
    weights: NDArray[np.float64]


# DERIVATIVES[order, function, power]: the four functions of an element (left value, left slope,
# right value, right slope) as polynomials in t = 0..1, and their derivatives by t.
DERIVATIVES = np.zeros((4, 4, 4))
DERIVATIVES[0] = [[1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]]
for _order in (1, 2, 3):
    DERIVATIVES[_order, :, :3] = DERIVATIVES[_order - 1, :, 1:] * np.arange(1, 4)


@njit(cache=True, nogil=True)
def hermite(x: NDArray, spacing: float, count: int, order: int) -> tuple[NDArray, NDArray]:
    """Stencil of the derivative of an order at points of a line.

    Parameters
    ----------
    x : (K,) float64, mm
        Places on the line, 0 to `count * spacing`.
    spacing : float, mm
        Length of an element.
    count : int
        Number of elements.
    order : int
        0 to 3; the second derivative is exact to h², the lower ones to h⁴ and h³.

    Returns
    -------
    start (K,) int64, weights (K, 4) float64 in mm^-order, the fields of a `Stencil`
    """
    start = np.empty(x.size, np.int64)
    weights = np.empty((x.size, 4))
    unit = spacing**-order
    for k in range(x.size):
        element = min(max(int(x[k] / spacing), 0), count - 1)
        t = x[k] / spacing - element
        start[k] = 2 * element
        for i in range(4):
            c = DERIVATIVES[order, i]
            weights[k, i] = unit * (c[0] + t * (c[1] + t * (c[2] + t * c[3])))
    return start, weights


def gram(spacing: float, count: int, p: int, q: int) -> sp.csr_array:
    """Integrals of products of derivatives of the Hermite functions of a line.

    Parameters
    ----------
    spacing, count : float in mm, int
        Length and number of the elements.
    p, q : int
        Orders of derivative of the row's and of the column's function.

    Returns
    -------
    (2 count + 2, 2 count + 2) float64, mm^(1 - p - q)
    """
    powers = np.arange(4)
    moments = 1.0 / (powers[:, None] + powers + 1)  # ∫ t^k t^l over the element
    element = DERIVATIVES[p] @ moments @ DERIVATIVES[q].T * spacing ** (1 - p - q)
    first = 2 * np.arange(count)[:, None, None]
    rows, columns, values = np.broadcast_arrays(first + powers[:, None], first + powers, element)
    shape = (2 * count + 2, 2 * count + 2)
    return sp.coo_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=shape).tocsr()

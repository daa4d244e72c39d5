"""Cubic Hermite functions on a line of elements.

Along one axis a function is held by its value and its slope at each node, the slope times the
mean element length u so that both have one unit: unknowns (v0, u v0', v1, u v1', ...). Products of
two such lines are the rectangle of Bogner, Fox & Schmit (1965), C1 everywhere; all matrices and all
evaluations on the plate are therefore products of what stands here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from fe.arrays import F64, I64
from fe.compiled import njit
from fe.elements.line import Line


class Stencil(NamedTuple):
    """K linear functionals of the unknowns of one axis, each on a window of w neighbours.

    Attributes
    ----------
    start : (K,) int64
        First unknown of each window.
    weights : (K, w) float64
        Weight of each unknown.
    """

    start: I64
    weights: F64

    @property
    def columns(self) -> I64:
        """Unknowns (K, w) of each window."""
        return self.start[:, None] + np.arange(self.weights.shape[1], dtype=np.int64)


HERMITE_DERIVATIVES = np.zeros((4, 4, 4))
"""[order, function, power]: the four functions of an element (left value, left slope, right value,
right slope) as polynomials in t = 0..1, and their derivatives by t."""
HERMITE_DERIVATIVES[0] = [[1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]]
for _order in (1, 2, 3):
    HERMITE_DERIVATIVES[_order, :, :3] = HERMITE_DERIVATIVES[_order - 1, :, 1:] * np.arange(1, 4)


def hermite(x: F64, line: Line, order: int) -> Stencil:
    """Take the derivative of an order at points of a line.

    Parameters
    ----------
    x : (K,) float64, mm
        Places on the line.
    line : Line
    order : int
        0 to 3; the second derivative is exact to h², the lower ones to h⁴ and h³.

    Returns
    -------
    Stencil
        Windows of 4 unknowns, weights in mm^-order.
    """
    return Stencil(*_hermite(x, line.nodes, line.unit, order))


@njit(cache=True, nogil=True)
def _hermite(x: F64, nodes: F64, unit: float, order: int) -> tuple[I64, F64]:
    start = np.empty(x.size, np.int64)
    weights = np.empty((x.size, 4))
    for k in range(x.size):
        place: float = x[k]
        element = np.searchsorted(nodes, place, side="right") - 1
        element = min(max(element, 0), nodes.size - 2)
        h = nodes[element + 1] - nodes[element]
        t = (x[k] - nodes[element]) / h
        start[k] = 2 * element
        for i in range(4):
            c = HERMITE_DERIVATIVES[order, i]
            scale = h**-order if i % 2 == 0 else h**-order * (h / unit)
            weights[k, i] = scale * (c[0] + t * (c[1] + t * (c[2] + t * c[3])))
    return start, weights


def hermite_gram(
    line: Line,
    p: int,
    q: int,
    run: tuple[int, int] | None = None,
    weights: F64 | None = None,
) -> sp.csr_array:
    """Integrals of products of derivatives of the Hermite functions of a line.

    Parameters
    ----------
    line : Line
    p, q : int
        Orders of derivative of the row's and of the column's function.
    run : tuple of int, optional
        First and last node of the part to integrate over; the whole line if left out.
    weights : (elements,) float64, optional
        Factor of each element of that part.

    Returns
    -------
    (unknowns, unknowns) float64, mm^(1 - p - q)
    """
    first, last = run or (0, line.count)
    h = np.diff(line.nodes)[first:last, None, None]
    powers = np.arange(4)
    moments = 1.0 / (powers[:, None] + powers + 1)  # ∫ t^k t^l over the element
    slopes = (h / line.unit) ** (powers % 2)  # (elements, 1, 4)
    unit_element = HERMITE_DERIVATIVES[p] @ moments @ HERMITE_DERIVATIVES[q].T
    element = unit_element * h ** (1 - p - q) * slopes * slopes.swapaxes(1, 2)
    if weights is not None:
        element = element * weights[:, None, None]
    start = 2 * np.arange(first, last)[:, None, None]
    rows, columns, values = np.broadcast_arrays(start + powers[:, None], start + powers, element)
    shape = (line.unknowns, line.unknowns)
    return sp.coo_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=shape).tocsr()

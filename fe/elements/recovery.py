"""Curvatures to fourth order in the element length from the unknowns of Hermite elements.

The second derivative of a cubic is exact only to h². The nodal values and slopes of the solution
are better than that, so the curvature is taken from them by differences that use both, and carried
from the nodes to any point by a cubic through four of them. Nothing reaches over a break of the
line, where curvature may jump. All of it is linear, hence the strain
of a gauge is a fixed functional and has an adjoint.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from fe.arrays import F64, I64
from fe.elements.hermite import Stencil, hermite
from fe.elements.line import Line

# Weights of (v, h v') at successive nodes for h² v''. Inside, at nodes -1, 0, 1:
# 2 δ²v - h δ(v')/2, error -h⁶/360 v⁽⁶⁾. At the end, from nodes 0, 1, 2: the second derivative of
# the quintic through all six numbers, error of h⁶ as well.
_INSIDE = np.array([2.0, 0.5, -4.0, 0.0, 2.0, -0.5])
_AT_END = np.array([-11.5, -6.0, 8.0, -8.0, 3.5, -1.0])
_MIRROR = np.array([1.0, -1.0] * 3)

# A cubic through four nodes whose curvatures reach one node further on each side: six nodes.
_WINDOW = 12
FEWEST = 5
"""Elements that a run between two breaks needs at least for that window."""


def recover(x: F64, line: Line, order: int) -> Stencil:
    """Stencil of a derivative at points of a line, with an error of h⁴.

    Parameters
    ----------
    x : (K,) float64, mm
        Places on the line.
    line : Line
        With at least `FEWEST` elements between breaks.
    order : int
        0, 1 or 2.

    Returns
    -------
    Stencil
        Windows of 4 unknowns for order 0 and of 12 for the others, weights in mm^-order.
    """
    if order == 0:
        return hermite(x, line, 0)
    start = np.empty(x.size, dtype=np.int64)
    weights = np.zeros((x.size, _WINDOW))
    run = line.run_of(x)
    for k, (first, last) in enumerate(line.runs):
        here = run == k
        length = (line.nodes[last] - line.nodes[first]) / (last - first)
        s = (x[here] - line.nodes[first]) / length
        start[here], weights[here] = _in_run(s, last - first, order)
        start[here] += 2 * first
        weights[here] /= length**order
        weights[here, 1::2] *= length / line.unit
    return Stencil(start, weights)


def _in_run(s: F64, count: int, order: int) -> tuple[I64, F64]:
    """Stencil at places s (K,) in elements from the first of `count` of unit length."""
    node = np.clip(np.floor(s).astype(np.int64) - 1, 0, count - 3)
    start = 2 * np.clip(node - 1, 0, count - 5)
    columns = start[:, None] + np.arange(_WINDOW)
    weights = np.zeros((s.size, _WINDOW))
    for j, lagrange in enumerate(_cubic(s - node)):
        weights += lagrange[:, None] * _nodal(count, order)[(node + j)[:, None], columns]
    return start, weights


def _cubic(t: F64) -> list[F64]:
    """Lagrange polynomials of the nodes 0, 1, 2, 3 at t, one array (K,) a node."""
    return [
        -(t - 1) * (t - 2) * (t - 3) / 6,
        t * (t - 2) * (t - 3) / 2,
        -t * (t - 1) * (t - 3) / 2,
        t * (t - 1) * (t - 2) / 6,
    ]


@lru_cache(maxsize=16)
def _nodal(count: int, order: int) -> F64:
    """Matrix (count + 1, 2 count + 2) from the unknowns to h^order times the derivative."""
    matrix = np.zeros((count + 1, 2 * count + 2))
    if order == 1:
        matrix[np.arange(count + 1), 2 * np.arange(count + 1) + 1] = 1.0
        return matrix
    for node in range(1, count):
        matrix[node, 2 * node - 2 : 2 * node + 4] = _INSIDE
    matrix[0, :6] = _AT_END
    # Reversed in the order of nodes, and slopes change sign.
    matrix[count, -6:] = (_AT_END * _MIRROR).reshape(3, 2)[::-1].ravel()
    return matrix

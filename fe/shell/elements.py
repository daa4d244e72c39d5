"""Quadrature and sparse pattern of the shell on a mesh, made once."""

from __future__ import annotations

import numpy as np

from fe.arrays import F64, I32, I64
from fe.elements.hermite import hermite
from fe.elements.line import Line
from fe.elements.mesh import Mesh, on_elements
from fe.elements.rise import rise
from fe.plate.plate import Plate
from fe.shell.kernel import Rule

# Points of Gauss along each side of an element.
_POINTS = 4


def rule(plate: Plate, mesh: Mesh) -> Rule:
    """Elements of a plate on a mesh with their quadrature."""
    thickness, young = on_elements(plate, mesh)
    membrane = young * thickness / (1.0 - plate.poisson**2)
    (x, weight_x), (y, weight_y) = (_quadrature(line) for line in mesh.lines)
    bending = membrane * thickness**2 / 12.0
    rest = _rest(rise(plate, mesh)[:, :, 0], x, y)
    return Rule(x, y, weight_x, weight_y, membrane, bending, plate.poisson, plate.tension, rest)


def _rest(table: F64, x: F64, y: F64) -> F64:
    """Read derivatives x, y, xx, yy, xy of a table at the points: (nx, ny, G, G, 5) float64."""
    windows = np.lib.stride_tricks.sliding_window_view(table, (4, 4))[::2, ::2]
    orders = ((1, 0), (0, 1), (2, 0), (0, 2), (1, 1))
    parts = [np.einsum("egi,efij,fkj->efgk", x[:, :, p], windows, y[:, :, q]) for p, q in orders]
    return np.stack(parts, axis=-1)


def _quadrature(line: Line) -> tuple[F64, F64]:
    """Return the functions (n, G, 3, 4) of a line at points of Gauss, and the weights (n, G)."""
    places, weights = np.polynomial.legendre.leggauss(_POINTS)
    h = np.diff(line.nodes)[:, None]
    x = line.nodes[:-1, None] + 0.5 * h * (1.0 + places)
    orders = [hermite(x.ravel(), line, order).weights.reshape(*x.shape, 4) for order in range(3)]
    return np.ascontiguousarray(np.stack(orders, axis=2)), 0.5 * h * weights


def pattern(mesh: Mesh) -> tuple[I64, I32]:
    """Row starts and columns of the tangent: an unknown meets a rectangle of the table.

    Returns
    -------
    starts : (N + 1,) int64
    columns : (nonzeros,) int32
    """
    (low_x, end_x), (low_y, end_y) = (_reach(line) for line in mesh.lines)
    counts = np.repeat(np.outer(end_x - low_x, end_y - low_y).ravel() * 3, 3)
    starts = np.concatenate([[0], np.cumsum(counts)])
    rows = np.repeat(np.arange(len(counts)), counts)
    offset = np.arange(int(starts[-1])) - np.repeat(starts[:-1], counts)
    row, column = np.divmod(rows // 3, mesh.shape[1])
    width = 3 * (end_y - low_y)[column]
    place = low_x[row] + offset // width
    columns = 3 * (place * mesh.shape[1] + low_y[column]) + offset % width
    return starts, columns.astype(np.int32)


def _reach(line: Line) -> tuple[I64, I64]:
    """First and last + 1 of the unknowns that share an element with each unknown of a line."""
    node = np.arange(line.unknowns) // 2
    return np.maximum(2 * node - 2, 0), np.minimum(2 * node + 4, line.unknowns)

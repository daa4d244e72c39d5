"""Shapes that a plate may have at rest: smooth, and level where an edge holds."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Legendre

from fe.arrays import F64
from fe.elements.line import Line
from fe.elements.mesh import Mesh
from fe.modal.transverse import held_polynomials
from fe.plate.edges import Edge
from fe.plate.plate import Plate
from fe.plate.shape import Shape

# Legendre orders of the shapes, in the order of `parameters.SHAPES`.
_ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


def shapes(plate: Plate, mesh: Mesh) -> F64:
    """Shapes at rest, which vanish with their slope where an edge holds: (2nx + 2, 2ny + 2, 6) mm.

    The first is 1 mm high in the middle.
    """
    x, y = (_along(line, plate.sides.along(axis)) for axis, line in enumerate(mesh.lines))
    return np.stack([np.outer(x[:, i], y[:, j]) for i, j in _ORDERS], axis=2)


def _along(line: Line, ends: tuple[Edge, Edge]) -> F64:
    """Shapes of orders 0 to 2 along a line: (2 n + 2, 3), Legendre's times a bow between clamps."""
    if not all(edge.springs.deflection > 0 for edge in ends):
        return held_polynomials(line, ends, 3)
    s, scale = 2.0 * line.nodes / line.nodes[-1] - 1.0, 2.0 / line.nodes[-1] * line.unit
    bow, rise = 0.5 + 0.5 * np.cos(np.pi * s), -0.5 * np.pi * np.sin(np.pi * s)
    unknowns = np.empty((line.unknowns, 3))
    for order in range(3):
        shape = Legendre.basis(order)
        unknowns[::2, order] = bow * shape(s)
        unknowns[1::2, order] = (rise * shape(s) + bow * shape.deriv()(s)) * scale
    return unknowns


def nearest(plate: Plate, mesh: Mesh, shape: Shape) -> F64:
    """Amplitudes (6,) of the shapes that come nearest to one at the nodes."""
    functions = shapes(plate, mesh)[::2, ::2].reshape(-1, len(_ORDERS))
    wanted = shape.on_grid(plate.size, *mesh.nodes).ravel()
    return np.asarray(np.linalg.lstsq(functions, wanted, rcond=None)[0], dtype=np.float64)

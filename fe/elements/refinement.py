"""Functions of one mesh on another."""

from __future__ import annotations

import numpy as np

from fe.arrays import F64
from fe.elements.functional import derivative
from fe.elements.mesh import Mesh


def refined(coarse: Mesh, values: F64, fine: Mesh) -> F64:
    """Unknowns on a finer mesh of the functions (2 nx + 2, 2 ny + 2, C) on a coarse one."""
    x, y = np.meshgrid(*fine.nodes, indexing="ij")
    xy, table = np.column_stack([x.ravel(), y.ravel()]), np.empty((*fine.shape, values.shape[2]))
    for p in (0, 1):
        for q in (0, 1):
            scale = fine.units[0] ** p * fine.units[1] ** q
            read = derivative(coarse, xy, p, q).of(values)
            table[p::2, q::2] = scale * read.reshape(*x.shape, -1)
    return table

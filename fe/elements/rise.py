"""The shape of a plate at rest on a mesh."""

from __future__ import annotations

import numpy as np

from fe.arrays import F64
from fe.elements.mesh import Mesh
from fe.plate.plate import Plate


def rise(plate: Plate, mesh: Mesh) -> F64:
    """Unknowns (2 nx + 2, 2 ny + 2, 1) of the height w0 of the middle surface at rest, mm."""
    table = np.zeros((*mesh.shape, 1))
    if plate.shape is None:
        return table
    for p in (0, 1):
        for q in (0, 1):
            scale = mesh.units[0] ** p * mesh.units[1] ** q
            table[p::2, q::2, 0] = scale * plate.shape.on_grid(plate.size, *mesh.nodes, p, q)
    return table

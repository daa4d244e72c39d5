"""What the edges hold: all unknowns from the free ones, and the springs of elastic edges."""

from __future__ import annotations

from math import isinf
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from fe.arrays import F64, Mask
from fe.elements.band import by_nodes
from fe.elements.edge_gram import edge_gram
from fe.elements.hermite import hermite
from fe.elements.mesh import Mesh
from fe.plate.edges import taper_of
from fe.plate.plate import Plate


class Motion(NamedTuple):
    """Rigid motion of a clamp: X goes to turn X + shift.

    Attributes
    ----------
    turn : (3, 3) float64
        Rotation matrix.
    shift : (3,) float64, mm
    """

    turn: F64
    shift: F64


UNMOVED = Motion(np.eye(3), np.zeros(3))


class Support(NamedTuple):
    """Constraint full = lift + free z on the flattened table of unknowns (2 nx + 2, 2 ny + 2, 3).

    Attributes
    ----------
    lift : (N,) float64, mm
    free : (N, Z) sparse
        Orthonormal columns, node after node along the shorter side, so that a matrix of z has a
        narrow band.
    """

    lift: F64
    free: sp.csr_array


def support(plate: Plate, mesh: Mesh, west: Motion = UNMOVED, east: Motion = UNMOVED) -> Support:
    """Hold the edges, the west and the east one after rigid motions of their clamps.

    A clamp holds place and normal. The slope across it may stretch and shear in the tangent plane,
    so of each slope across the edge and of each twist the part along the turned normal is held.
    """
    held = _held(plate, mesh)
    lift = np.zeros(held.shape)
    axes = np.zeros((*held.shape, 3))
    axes[:] = np.eye(3)
    (ux, uy), y = mesh.units, mesh.nodes[1]
    for first, x, motion in ((0, 0.0, west), (mesh.shape[0] - 2, plate.size[0], east)):
        change = motion.turn - np.eye(3)
        edge = np.column_stack([np.full(len(y), x), y, np.zeros(len(y))])
        lift[first, 0::2] = edge @ change.T + motion.shift
        lift[first, 1::2] = uy * change[:, 1]
        lift[first + 1, 0::2] = ux * change[:, 0]
        axes[first + 1] = motion.turn
    size, order = held.size, by_nodes(mesh, 3)
    blocks = sp.bsr_array(
        (axes.reshape(-1, 3, 3), np.arange(size // 3), np.arange(size // 3 + 1)), shape=(size, size)
    )
    kept = order[~held.ravel()[order]]
    return Support(lift.ravel(), sp.csr_array(blocks.tocsc()[:, kept]))


def _held(plate: Plate, mesh: Mesh) -> Mask:
    """Unknowns (2 nx + 2, 2 ny + 2, 3) that rigid springs hold, in the axes of their edge."""
    held = np.zeros((*mesh.shape, 3), dtype=bool)
    for axis in (0, 1):
        table = held.swapaxes(0, axis)
        for edge, value in zip(plate.sides.along(axis), (0, mesh.shape[axis] - 2), strict=True):
            table[value, :, :2] |= isinf(edge.springs.membrane)
            table[value, :, 2] |= isinf(edge.springs.deflection)
            table[value + 1, :, 2] |= isinf(edge.springs.rotation)
    return held


def springs(plate: Plate, mesh: Mesh) -> sp.csr_array:
    """Stiffness (N, N) of the elastic edges in N/mm: on deflection, slope across and membrane.

    They act along and across the axes of the flat plate.
    """
    size = mesh.shape[0] * mesh.shape[1] * 3
    matrix = sp.csr_array((size, size))
    for axis, line in enumerate(mesh.lines):
        for end, edge in enumerate(plate.sides.along(axis)):
            deflection, rotation, membrane = zip(edge.springs, taper_of(edge), strict=True)
            for order, component, (spring, taper) in (
                (0, (1, 1, 0), membrane),
                (0, (0, 0, 1), deflection),
                (1, (0, 0, 1), rotation),
            ):
                if spring == 0 or isinf(spring):
                    continue
                start, weights = hermite(line.nodes[[-end]], line, order)
                row = np.zeros((1, line.unknowns))
                row[0, start[0] : start[0] + 4] = weights
                across, along = sp.csr_array(row.T @ row), edge_gram(mesh.lines[1 - axis], taper)
                pair = (across, along) if axis == 0 else (along, across)
                each = spring * np.array(component, float)
                matrix = matrix + sp.kron(sp.kron(*pair), sp.diags_array(each))
    return sp.csr_array(matrix)

"""Functions that carry the deflection: modes of the rigidly held plate, and turns of its edges.

An edge that a description holds in rotation may turn on the bench. Functions that turn it by a few
smooth waves, and bend the plate least beside that, stand beside the modes of the plate that holds
it; they do no work on one another.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isinf

import numpy as np
from numpy.polynomial import Legendre, Polynomial

from fe.arrays import F64
from fe.elements.functional import derivative
from fe.elements.gauss import dense
from fe.elements.line import Line
from fe.elements.mesh import Mesh
from fe.linear.energy import Free, free, stiffness
from fe.linear.linear import Linear
from fe.linear.plate_modes import modes
from fe.modal.parameters import SIDES
from fe.plate.edges import Edge, Edges, Springs, edge_of
from fe.plate.plate import Plate

WAVES = 4
"""Of each edge that may turn."""

_DETAIL = 1.5  # details by modes: with them the modal plate carries a touch to 0.1 %


@dataclass(frozen=True, eq=False)
class Transverse:
    """Functions of the deflection: K modes, then J turns; and D details beside them.

    Attributes
    ----------
    held : Plate
        The plate with every spring of rotation and of membrane rigid.
    mesh : Mesh
    count : int
        K.
    values : (2 nx + 2, 2 ny + 2, K + J) float64
        Unknowns of the functions; the modes in 1/mm, the turns in mm.
    stiffness : (K + J, K + J) float64
        Bending energy.
    giving : (8, J, J) float64
        Turns by a unit of moment on them, by a unit of compliance of each edge and of its slope.
    details : (2 nx + 2, 2 ny + 2, D) float64, 1/mm
        Unknowns of the modes that follow the first K.
    firmness : (D,) float64
        Their bending energy.
    """

    held: Plate
    mesh: Mesh
    count: int
    values: F64
    stiffness: F64
    giving: F64
    details: F64
    firmness: F64

    def at(self, xy: F64, p: int = 0, q: int = 0) -> F64:
        """Compute derivatives of order p by x and q by y at points (N, 2) mm: (N, K + J)."""
        return derivative(self.mesh, xy, p, q).of(self.values)


def transverse(plate: Plate, mesh: Mesh, count: int, waves: int = WAVES) -> Transverse:
    """Compute `count` modes of a plate on a mesh, and turns of each edge by so many `waves`."""
    held = rigidly_held(plate)
    shapes = modes(held, count + _details(mesh, count), mesh)
    kept, further = np.split(shapes.values, [count], axis=2)
    turned, giving = _turns(held, mesh, waves)
    matrix = np.zeros((count + len(giving[0]),) * 2)
    matrix[:count, :count] = np.diag(shapes.stiffness[:count])
    matrix[count:, count:] = _bending(held, mesh, turned)
    values = np.concatenate([kept, turned], axis=2)
    firmness = shapes.stiffness[count:]
    return Transverse(held, mesh, count, values, matrix, giving, further, firmness)


def _details(mesh: Mesh, count: int) -> int:
    """How many modes beyond the first ones a mesh can carry, as far as they matter."""
    nx, ny = mesh.counts
    return max(min(int(_DETAIL * count), nx * ny // 4 - count), 0)


def bending_read(functions: Transverse, loads: F64) -> Transverse:
    """Return the same functions with other details: what the modes leave out of what is read of w.

    An adjoint solution is what is read of a touch anywhere, all modes in it.

    Parameters
    ----------
    functions : Transverse
    loads : (2 nx + 2, 2 ny + 2, R) float64
        Readings by the unknowns of w.
    """
    adjoint = Linear(functions.held, functions.mesh).solve(loads)
    kept, firm = functions.values[..., : functions.count], np.diag(functions.stiffness)
    amplitudes = np.tensordot(kept, loads, ([0, 1], [0, 1])) / firm[: functions.count, None]
    left = adjoint - np.tensordot(kept, amplitudes, 1)
    return replace(functions, details=left, firmness=np.ones(left.shape[2]))


def rigidly_held(plate: Plate) -> Plate:
    """Return the flat, untense plate that is rigid wherever a spring of rotation or membrane is."""
    sides = {side: _rigid(getattr(plate.sides, side)) for side in SIDES}
    return replace(plate, edges=Edges(**sides), tension=(0.0, 0.0, 0.0), shape=None)


def _rigid(edge: Edge) -> Edge:
    springs = edge.springs
    rotation, membrane = (np.inf if spring > 0 else 0.0 for spring in springs[1:])
    return edge_of(Springs(springs.deflection, rotation, membrane))


def _turns(held: Plate, mesh: Mesh, count: int) -> tuple[F64, F64]:
    """Unknowns (2 nx + 2, 2 ny + 2, J) of all turns and how edges give to moments, (8, J, J)."""
    linear, kept = Linear(held, mesh), loosened(held, mesh)
    index, matrix = np.ix_(*kept), stiffness(held, mesh, kept)
    turning = [k for k, edge in enumerate(_in_order(held)) if isinf(edge.springs.rotation)]
    tables = [np.zeros((*mesh.shape, 0))]
    giving = np.zeros((8, count * len(turning), count * len(turning)))
    for block, edge in enumerate(turning):
        axis, last = divmod(edge, 2)
        # Along the next edges nothing deflects, and this one turns least where it meets them.
        waves = held_polynomials(mesh.lines[1 - axis], held.sides.along(1 - axis), count)
        table = np.zeros((*mesh.shape, count))
        # The unknown of a slope is the slope times the mean length of an element.
        np.moveaxis(table, axis, 0)[-1 if last else 1] = waves * mesh.units[axis]
        loads = np.zeros(table.shape)
        loads[index] = (matrix @ table[index].reshape(-1, count)).reshape(table[index].shape)
        tables.append(table - linear.solve(loads))
        own = slice(count * block, count * (block + 1))
        giving[2 * edge : 2 * edge + 2, own, own] = _compliance(mesh.lines[1 - axis], waves)
    return np.concatenate(tables, axis=2), giving


def loosened(held: Plate, mesh: Mesh) -> Free:
    """Which unknowns of w a plate leaves free whose edges may turn; see `fe.linear.energy.free`."""
    kept = free(held, mesh)
    for k, edge in enumerate(_in_order(held)):
        axis, last = divmod(k, 2)
        kept[axis][-1 if last else 1] |= isinf(edge.springs.rotation)
    return kept


def _in_order(plate: Plate) -> list[Edge]:
    """Edges in the order of `SIDES`."""
    return [getattr(plate.sides, side) for side in SIDES]


def held_polynomials(line: Line, ends: tuple[Edge, Edge], count: int) -> F64:
    """Polynomials along a line that vanish with their slope at each end held: (2 n + 2, count)."""
    s, unknowns = 2.0 * line.nodes / line.nodes[-1] - 1.0, np.empty((line.unknowns, count))
    window = Polynomial([1.0])
    for edge, towards in zip(ends, (1.0, -1.0), strict=True):
        if edge.springs.deflection > 0:
            window = window * Polynomial([1.0, towards]) ** 2
    for order in range(count):
        shape = window * Legendre.basis(order).convert(kind=Polynomial)
        unknowns[::2, order] = shape(s)
        unknowns[1::2, order] = shape.deriv()(s) * 2.0 / line.nodes[-1] * line.unit
    return unknowns


def _compliance(line: Line, waves: F64) -> F64:
    """Turn of each wave by a unit moment on each, (2, waves, waves): even, and rising along s."""
    even, rising = (waves.T @ (gram @ waves) for gram in (moments(line, 0), moments(line, 1)))
    inverse = np.asarray(np.linalg.inv(even), dtype=np.float64)
    return np.stack([inverse, inverse @ rising @ inverse])


def moments(line: Line, power: int) -> F64:
    """Integrals ∫ sᵖ f g of functions of a line, s from -1 to 1 along it: (2 n + 2, 2 n + 2)."""
    t, weight = np.polynomial.legendre.leggauss(5)
    lengths = np.diff(line.nodes)[:, None]
    places = (line.nodes[:-1, None] + 0.5 * lengths * (t + 1.0)).ravel()
    weights = (0.5 * lengths * weight).ravel() * (2.0 * places / line.nodes[-1] - 1.0) ** power
    at = dense(places, line, 0)
    return at.T @ (weights[:, None] * at)


def _bending(held: Plate, mesh: Mesh, turned: F64) -> F64:
    """Bending energy of turns, (J, J)."""
    kept = loosened(held, mesh)
    matrix = stiffness(held, mesh, kept)
    flat = turned[np.ix_(*kept)].reshape(matrix.shape[0], -1)  # also where no edge turns
    return flat.T @ (matrix @ flat)

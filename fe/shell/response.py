"""The response of a bent plate to a touch anywhere on it, to third order in the force."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.linalg import eigh

from fe.arrays import F64
from fe.elements.band import Band, cholesky
from fe.elements.functional import derivative
from fe.elements.mesh import Mesh
from fe.linear.linear import Face, height
from fe.plate.plate import Plate
from fe.shell.base import Base
from fe.shell.measure import surface
from fe.shell.shell import Shell
from fe.shell.state import ShellState

ORDERS = 3
# Of the nodes, the places of the higher orders, which are smooth and small.
_EVERY = 2
# Of the largest: fields that weigh less are rounding.
_ROUNDING = 1e-13
# By which clamps move for the derivative of a state by its base, mm and degrees.
_CLAMPS = 1e-4
# Force by which the orders weigh in the choice of fields, N: a finger's.
_TYPICAL = 1.5


@dataclass(frozen=True, eq=False)
class ShellResponse:
    """Displacement by a touch on a state as amplitudes of K fields.

    Under a force F at x it is Σ_k φ_k (F a_k(x) + F² b_k(x) + F³ c_k(x)): the first order is that
    of the tangent, the others what the potential adds to it.

    Attributes
    ----------
    state : ShellState
        What the touch presses on.
    fields : (2 nx + 2, 2 ny + 2, 3 K) float64
        Unknowns of u of all fields, then v, then w; orthonormal over the plate.
    series : (2 nx + 2, 2 ny + 2, 3 K) float64
        Amplitudes as functions of the place: a of all fields per N, b per N², c per N³.
    """

    state: ShellState
    fields: F64
    series: F64

    @property
    def plate(self) -> Plate:
        """The plate."""
        return self.state.plate

    @property
    def count(self) -> int:
        """Number K of fields."""
        return self.fields.shape[2] // 3

    def amplitudes(self, xy: ArrayLike, force: ArrayLike) -> F64:
        """Amplitudes (n, K) under each of n touches alone."""
        return (self._orders(xy, 0, 0) @ _powers(force))[:, :, 0]

    def gradient(self, xy: ArrayLike, force: ArrayLike) -> F64:
        """Differentiate `amplitudes` by x, y and force, (n, K, 3)."""
        along = [self._orders(xy, p, q) @ _powers(force) for p, q in ((1, 0), (0, 1))]
        pushed = self._orders(xy, 0, 0) @ _slopes(force)
        return np.concatenate([*along, pushed], axis=2)

    def nonlinearity(self, xy: ArrayLike, force: ArrayLike) -> F64:
        """How much of the response is not that of the tangent, by the last order kept: (n,).

        The ratio of one order to the one before, so that what was left out is about its cube.
        """
        orders, force = self._orders(xy, 0, 0), np.asarray(force, dtype=np.float64)
        first, second, third = np.linalg.norm(orders, axis=1).T
        first = np.maximum(first, np.finfo(np.float64).tiny)
        return np.maximum(force * second / first, force * np.sqrt(third / first))

    def motion(self, xy: ArrayLike, face: Face = "top") -> F64:
        """Displacement of a face by a unit of every field at points (N, 2) mm, (N, 3, K) mm."""
        return face_motion(self.state, self.fields, xy, face)

    def _orders(self, xy: ArrayLike, p: int, q: int) -> F64:
        """Amplitudes of each order, (n, K, 3)."""
        xy = self.plate.points(xy, "touch")
        read = derivative(self.state.mesh, xy, p, q).of(self.series)
        return read.reshape(len(xy), ORDERS, -1).swapaxes(1, 2)


def face_motion(state: ShellState, fields: F64, xy: ArrayLike, face: Face = "top") -> F64:
    """Displacement of a face by a unit of small fields on a state, (N, 3, K) mm.

    Parameters
    ----------
    state : ShellState
    fields : (2 nx + 2, 2 ny + 2, 3 K) float64
        Unknowns of u of all fields, then v, then w.
    xy : (N, 2) array_like, mm
    face : {"top", "middle", "bottom"}
    """
    xy, mesh = state.plate.points(xy), state.mesh
    moved, along, across = (
        derivative(mesh, xy, p, q).of(fields).reshape(len(xy), 3, -1)
        for p, q in ((0, 0), (1, 0), (0, 1))
    )
    bent = surface(state.place(xy, derivative))
    # The normal turns by -aᵅ (n·U,α).
    turned = -sum(
        np.einsum("nc,nk->nck", bent.duals[:, a], np.einsum("nc,nck->nk", bent.normal, slope))
        for a, slope in enumerate((along, across))
    )
    return moved + height(state.plate, xy, face)[:, None, None] * turned


def base_tangent(state: ShellState) -> F64:
    """Unknowns (2 nx + 2, 2 ny + 2, 6) of how a state changes with its base.

    Of u, v and w each per mm of bend and per degree of twist, on the tangent of the state.

    Raises
    ------
    ValueError
        The state is not a stable equilibrium.
    """
    tangent, values = _Tangent.of(state), state.values.ravel()
    stiffness = state.shell.system.tangent(values)
    columns: list[F64] = []
    for bend, twist in ((_CLAMPS, 0.0), (0.0, _CLAMPS)):
        base = Base(state.base.bend + bend, state.base.twist + twist)
        lift, free = state.shell.support(base)
        jump = lift + free @ (free.T @ (values - lift)) - values
        columns.append((jump - tangent.pressed(stiffness @ jump)) / _CLAMPS)
    table = np.stack(columns, axis=1).reshape(*state.mesh.shape, -1)
    return np.ascontiguousarray(table)


def _powers(force: ArrayLike) -> F64:
    """Return F, F², F³ of forces (n,), (n, 3, 1)."""
    return (np.atleast_1d(np.asarray(force, dtype=np.float64))[:, None] ** [1, 2, 3])[:, :, None]


def _slopes(force: ArrayLike) -> F64:
    each = np.atleast_1d(np.asarray(force, dtype=np.float64))[:, None]
    return (np.array([1.0, 2.0, 3.0]) * each ** np.array([0, 1, 2]))[:, :, None]


def shell_response(state: ShellState, count: int = 150) -> ShellResponse:
    """Prepare the response of a bent plate to touches.

    Every node is pressed against its normal on the tangent of the state. What the potential adds
    is the even and the odd part of the forces that are left over when the plate moves so far, and
    moves the plate on the same tangent.

    Parameters
    ----------
    state : ShellState
    count : int
        Fields kept, of least error over all places; no more than there are nodes that move.

    Raises
    ------
    ValueError
        The state is not a stable equilibrium.
    """
    tangent = _Tangent.of(state)
    first = tangent.pressed(_normal_loads(state))
    x, y = state.mesh.nodes
    nodes = np.arange(len(x) * len(y)).reshape(len(x), len(y))
    second, third = tangent.higher(first[:, nodes[::_EVERY, ::_EVERY].ravel()])
    fields = _fields(state.shell, (first, second, third), count)
    weighed = state.shell.system.mass @ fields
    series = [_table(state.mesh, (x, y), (weighed.T @ first).T)]
    for part in (second, third):
        series.append(_table(state.mesh, (x[::_EVERY], y[::_EVERY]), (weighed.T @ part).T))
    # Fields of u, v and w one after the other.
    table = fields.reshape(*state.mesh.shape, -1)
    return ShellResponse(
        state, np.ascontiguousarray(table), np.ascontiguousarray(np.concatenate(series, axis=2))
    )


@dataclass(frozen=True, eq=False)
class _Tangent:
    """The tangent of a state, factored."""

    state: ShellState
    free: sp.csr_array
    factor: Band

    @classmethod
    def of(cls, state: ShellState) -> _Tangent:
        """Factor the tangent of a state."""
        shell, factor = state.shell, None
        free = shell.support(state.base).free
        if state.stability.tangent_known:
            factor = cholesky(free.T @ shell.system.tangent(state.values.ravel()) @ free)
        if factor is None:
            raise ValueError(
                "response to touches needs a stable equilibrium, got a state of residual "
                f"{state.stability.residual:.2g} and smallest eigenvalue "
                f"{state.stability.eigenvalue:.2g} of that at rest; use a smaller load or base"
            )
        return cls(state, free, factor)

    def pressed(self, loads: F64) -> F64:
        """Move all unknowns by loads (N, P) on the tangent, (N, P)."""
        return np.asarray(self.free @ self.factor.solve(self.free.T @ loads))

    def higher(self, first: F64) -> tuple[F64, F64]:
        """Add what the potential does to displacements (N, P) per N: per N² and per N³."""
        even, odd = (np.empty_like(first) for _ in range(2))
        for column, way in enumerate(first.T):
            ahead, back = self._left_over(way), self._left_over(-way)
            even[:, column], odd[:, column] = (ahead + back) / 2, (ahead - back) / 2
        second = -self.pressed(even)
        for column, (way, more) in enumerate(zip(first.T, second.T, strict=True)):
            # 2 B(u1, u2) of the quadratic part, by the difference along u2.
            odd[:, column] += (self._even(way + more) - self._even(way - more)) / 2
        return second, -self.pressed(odd)

    def _even(self, way: F64) -> F64:
        return (self._left_over(way) + self._left_over(-way)) / 2

    def _left_over(self, way: F64) -> F64:
        """Return the forces (N,) after a displacement beyond those of the tangent."""
        system, values = self.state.shell.system, self.state.values.ravel()
        return system.forces(values + way)[1] - self._rest - self._stiffness @ way

    @cached_property
    def _rest(self) -> F64:
        return self.state.shell.system.forces(self.state.values.ravel())[1]

    @cached_property
    def _stiffness(self) -> sp.csr_array:
        return self.state.shell.system.tangent(self.state.values.ravel())


def _normal_loads(state: ShellState) -> F64:
    """Press every node, row after row, by 1 N against the normal: loads (N, P)."""
    mesh = state.mesh
    nx, ny = (len(line) for line in mesh.nodes)
    x, y = np.meshgrid(*mesh.nodes, indexing="ij")
    normal = state.normal(np.column_stack([x.ravel(), y.ravel()])).reshape(nx, ny, 3)
    loads = np.zeros((*mesh.shape, 3, nx, ny))
    i, j = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
    for c in range(3):
        loads[2 * i, 2 * j, c, i, j] = -normal[:, :, c]
    return loads.reshape(-1, nx * ny)


def _fields(shell: Shell, parts: tuple[F64, ...], count: int) -> F64:
    """Orthonormal fields (N, K) that carry responses of each order best, by snapshots."""
    weighed = [part * _TYPICAL**order for order, part in enumerate(parts)]
    shots = np.concatenate(weighed, axis=1)
    gram = shots.T @ (shell.system.mass @ shots)
    values, vectors = eigh(gram)
    kept = values > _ROUNDING * values[-1]
    values, vectors = values[kept][-count:][::-1], vectors[:, kept][:, -count:][:, ::-1]
    return shots @ (vectors / np.sqrt(values))


def _table(mesh: Mesh, lines: tuple[F64, F64], values: F64) -> F64:
    """Unknowns (2 nx + 2, 2 ny + 2, K) of cubic splines through values (P, K) at nodes of lines."""
    table = values.reshape(len(lines[0]), len(lines[1]), -1)
    for axis, (line, nodes, unit) in enumerate(zip(lines, mesh.nodes, mesh.units, strict=True)):
        spline = CubicSpline(line, table, axis=axis)
        both = np.stack([spline(nodes), unit * spline(nodes, 1)], axis=axis + 1)
        shape = list(table.shape)
        shape[axis] = 2 * len(nodes)
        table = both.reshape(shape)
    return table

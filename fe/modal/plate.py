"""A plate whose bench is not yet known, in a hundred modes: what it takes to bend it in any way.

Von Kármán's plate after Marguerre, w beside a shape w₀ at rest and stress N₀ in balance with it:

    K w + N₀ : ∇∇w + N : ∇∇(w + w₀) = F δ,   N = C (ε(u) + ½ ∇w∇w + ∇w₀∇w)

with w in modes and turns of the edges, N in stresses that balance themselves. All that remains of
the mesh are products of these functions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.polynomial import Legendre

from fe.arrays import F64, I64
from fe.elements.functional import derivative
from fe.elements.gauss import Gauss, dense
from fe.elements.line import Line
from fe.elements.mesh import Mesh, grid
from fe.elements.storage import restore, store
from fe.linear.energy import rigidities
from fe.linear.membrane import Membrane
from fe.modal.parameters import NAMES, SHAPE, SIDES, TENSION
from fe.modal.stresses import grading, stresses
from fe.modal.transverse import Transverse, held_polynomials, transverse
from fe.plate.checks import whole
from fe.plate.edges import Edge, taper_of
from fe.plate.plate import Plate
from fe.plate.shape import Shape

_ELEMENTS = 40  # along the longer side
_MODES = 160
# Modes beyond these bend, but stretch the plate too little to count.
_STRETCHING = 110
# Legendre orders of the shapes, in the order of `parameters.SHAPES`.
_ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


@dataclass(frozen=True, eq=False)
class ModalPlate:
    """Products of the functions of a plate, from which its states on any bench follow.

    Of n = K + J functions of the deflection c take part in stretching: the first modes and all J
    turns; M stresses and U displacements in the plane; S = 6 shapes.

    Attributes
    ----------
    plate : Plate
        As it is described.
    mesh : Mesh
    count : int
        Number of modes, K.
    values : (2 nx + 2, 2 ny + 2, n) float64
        Unknowns of the functions, along +z: modes in 1/mm, orthonormal over the plate, and turns.
    drifts : (2, 2 nx + 2, 2 ny + 2, U) float64
        Unknowns of the displacements in the plane, orthonormal over the plate.
    stiffness : (n, n) float64
        Bending energy.
    graded : (3, n, n) float64
        That of a thickness that rises along x, y and both, times 3.
    turning : (8, J, J) float64
        Turns by moments, for each edge and its slope.
    tense : (3, c, c) float64
        Products with uniform stresses xx, yy and xy of 1 N/mm.
    stretching : (M + U, c, c) float64
        Products with the stresses, then what gives the drifts.
    shaped : (S, M + U, c) float64
        The same with a shape of 1 mm.
    easing : (3, M, M) float64
        Complementary energy of the thickness that rises.
    giving : (8, M, M) float64
        That of the edges.
    slipping : (8, U, M) float64
        Drifts by stresses, for each edge and its slope.
    """

    plate: Plate
    mesh: Mesh
    count: int
    values: F64
    drifts: F64
    stiffness: F64
    graded: F64
    turning: F64
    tense: F64
    stretching: F64
    shaped: F64
    easing: F64
    giving: F64
    slipping: F64

    def value(self, xy: F64) -> F64:
        """Functions of the deflection at points (N, 2) mm: (N, n)."""
        return derivative(self.mesh, xy).of(self.values)

    def slope(self, xy: F64) -> F64:
        """Their slopes along x and y: (N, n, 2)."""
        slopes = [derivative(self.mesh, xy, *order).of(self.values) for order in ((1, 0), (0, 1))]
        return np.stack(slopes, axis=2)

    @property
    def turns(self) -> int:
        """Number of turns of the edges, J."""
        return self.turning.shape[1]

    @cached_property
    def described(self) -> F64:
        """Parameters (30,) that the description gives: tension, shape and how its edges give.

        A shape is the nearest one that vanishes where edges hold.
        """
        values = np.zeros(len(NAMES))
        values[TENSION] = self.plate.tension
        if self.plate.shape is not None:
            values[SHAPE] = _nearest(self.plate, self.mesh, self.plate.shape)
        for side in SIDES:
            edge = getattr(self.plate.sides, side)
            for kind in ("rotation", "membrane"):
                spring, taper = (getattr(part, kind) for part in (edge.springs, taper_of(edge)))
                if spring > 0:
                    values[NAMES.index(f"{kind}_{side}")] = 1.0 / spring
                    values[NAMES.index(f"{kind}_{side}_slope")] = taper / spring
        return values

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all of it as named arrays, for a file."""
        named: dict[str, Any] = {name: getattr(self, name) for name in _STORED}
        return store(self.plate, self.mesh, **named)

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> ModalPlate:
        """Build the plate that `arrays` wrote.

        Raises
        ------
        ValueError
            An array is missing or has the wrong shape.
        """
        plate, mesh, found = restore(arrays, *_STORED)
        named: dict[str, Any] = dict(zip(_STORED, found, strict=True))
        named["count"] = int(named["count"])
        return cls(plate, mesh, **named)


_STORED = tuple(field.name for field in fields(ModalPlate) if field.name not in ("plate", "mesh"))


def modal_plate(plate: Plate, count: int = _MODES, mesh: Mesh | None = None) -> ModalPlate:
    """Compute the products for a plate; half a minute.

    Parameters
    ----------
    plate : Plate
    count : int
        Number of modes.
    mesh : Mesh, optional
        `grid(plate, 40)` if left out.

    Raises
    ------
    ValueError
        The mesh cannot carry that many modes.
    """
    mesh = grid(plate, _ELEMENTS) if mesh is None else mesh
    functions = transverse(plate, mesh, whole(count, "number of modes"))
    shapes = _shapes(plate, mesh)
    plane = stresses(functions, shapes)
    rigid = Membrane(functions.held, mesh)
    taking_part = _taking_part(functions)
    slopes, rising = rigid.gauss.slopes(functions.values[..., taking_part]), _rising(rigid.gauss)
    uniform = np.eye(3)[:, None, None, :] * np.ones((1, *rigid.stiffness.shape, 1))
    all_stresses = np.concatenate([plane.stress, -plane.reading], axis=3)
    return ModalPlate(
        plate=plate,
        mesh=mesh,
        count=functions.count,
        values=functions.values,
        drifts=plane.drifts,
        stiffness=functions.stiffness,
        graded=_graded(functions, rigid.gauss, rising),
        turning=functions.giving,
        tense=_products(rigid.gauss, uniform, slopes, slopes),
        stretching=_products(rigid.gauss, all_stresses, slopes, slopes),
        shaped=_over_shapes(rigid.gauss, all_stresses, slopes, shapes),
        easing=np.stack([grading(rigid, plane.stress, weight) for weight in rising]),
        giving=plane.giving,
        slipping=plane.slipping,
    )


def _taking_part(functions: Transverse) -> I64:
    """Return indices of the functions that stretch the plate."""
    total = functions.values.shape[2]
    every = np.arange(total, dtype=np.int64)
    return np.concatenate([every[: min(_STRETCHING, functions.count)], every[functions.count :]])


def _shapes(plate: Plate, mesh: Mesh) -> F64:
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


def _nearest(plate: Plate, mesh: Mesh, shape: Shape) -> F64:
    """Amplitudes (6,) of the shapes that come nearest to one at the nodes."""
    functions = _shapes(plate, mesh)[::2, ::2].reshape(-1, len(_ORDERS))
    wanted = shape.on_grid(plate.size, *mesh.nodes).ravel()
    return np.asarray(np.linalg.lstsq(functions, wanted, rcond=None)[0], dtype=np.float64)


def _rising(gauss: Gauss) -> F64:
    """Functions x, y and x y from -1 to 1 over the plate at its Gauss points, (3, gx, gy)."""
    x, y = (
        2.0 * axis.places / (axis.places[0] + axis.places[-1]) - 1.0 for axis in (gauss.x, gauss.y)
    )
    even_x, even_y = np.ones(len(x)), np.ones(len(y))
    return np.stack([np.multiply.outer(a, b) for a, b in ((x, even_y), (even_x, y), (x, y))])


def _graded(functions: Transverse, gauss: Gauss, rising: F64) -> F64:
    """Bending energy, times 3, of thicknesses that rise: (3, n, n)."""
    (xx, yy, xy), nu = _curvatures(functions, gauss), functions.held.poisson
    rigidity = rigidities(functions.held, functions.mesh)
    points = len(gauss.x.places) // functions.mesh.counts[0]
    rigidity = rigidity.repeat(points, axis=0).repeat(points, axis=1)
    found: list[F64] = []
    for rise in rising:
        weight = (3.0 * rise * rigidity * gauss.weights).reshape(-1, 1)
        mixed = xx.T @ (weight * (xx + nu * yy)) + yy.T @ (weight * (yy + nu * xx))
        found.append(mixed + 2.0 * (1.0 - nu) * xy.T @ (weight * xy))
    return np.stack(found)


def _curvatures(functions: Transverse, gauss: Gauss) -> tuple[F64, F64, F64]:
    """Second derivatives xx, yy, xy at all Gauss points, three (gx gy, n)."""
    (x, y), values = functions.mesh.lines, functions.values
    n = values.shape[2]

    def derived(along: F64, across: F64) -> F64:
        return (across @ np.tensordot(along, values, 1)).reshape(-1, n)

    bent_x, bent_y = dense(gauss.x.places, x, 2), dense(gauss.y.places, y, 2)
    return (
        derived(bent_x, gauss.y.value),
        derived(gauss.x.value, bent_y),
        derived(gauss.x.slope, gauss.y.slope),
    )


def _products(gauss: Gauss, stress: F64, left: tuple[F64, F64], right: tuple[F64, F64]) -> F64:
    """Integrals ∫ N_ab f,a g,b dA of stresses (3, gx, gy, M) with pairs of functions: (M, L, R)."""
    lx, ly, rx, ry = (part.reshape(-1, part.shape[2]) for part in (*left, *right))
    area = gauss.weights.reshape(-1, 1)
    found = np.empty((stress.shape[3], lx.shape[1], rx.shape[1]))
    for m, (xx, yy, xy) in enumerate(np.moveaxis(stress, 3, 0).reshape(stress.shape[3], 3, -1, 1)):
        found[m] = lx.T @ (area * (xx * rx + xy * ry)) + ly.T @ (area * (xy * rx + yy * ry))
    return found


def _over_shapes(gauss: Gauss, stress: F64, slopes: tuple[F64, F64], shapes: F64) -> F64:
    """Products of stresses with shapes and functions, (S, M, c)."""
    found = _products(gauss, stress, gauss.slopes(shapes), slopes)
    return np.ascontiguousarray(found.swapaxes(0, 1))

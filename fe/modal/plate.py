"""A plate whose bench is not yet known, in a hundred modes: what it takes to bend it in any way.

Von Kármán's plate after Marguerre, w beside a shape w₀ at rest and stress N₀ in balance with it:

    K w + N₀ : ∇∇w + N : ∇∇(w + w₀) = F δ,   N = C (ε(u) + ½ ∇w∇w + ∇w₀∇w)

with w in modes and turns of the edges, N in stresses that balance themselves. All that remains of
the mesh are products of these functions. The details, modes beyond those, bend alone: what a touch
moves at its place, which tension hardly changes (residual flexibility). Where they are what modes
leave out of a reading, all forces of the plane bend them too (static correction).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from fe.arrays import F32, F64
from fe.elements.functional import derivative
from fe.elements.mesh import Mesh
from fe.elements.storage import restore, store
from fe.modal.parameters import NAMES, SHAPE, SIDES, TENSION
from fe.modal.shapes import nearest
from fe.plate.edges import taper_of
from fe.plate.plate import Plate


@dataclass(frozen=True, eq=False)
class Corrections:
    """How the forces of the plane bend the details: products of D details.

    Attributes
    ----------
    tense : (3, D, n) float64
        With the functions, in uniform stresses of 1 N/mm.
    stretching : (M, D, n) float64
        The same in the stresses.
    shaped : (S, M, D) float64
        With the shapes, in the stresses.
    """

    tense: F64
    stretching: F64
    shaped: F64


@dataclass(frozen=True, eq=False)
class ModalPlate:
    """Products of the functions of a plate, from which its states on any bench follow.

    Of n = K + J functions of the deflection, modes and turns; M stresses and U displacements in
    the plane; S = 6 shapes.

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
    graded : (27, n, n) float64
        That of a thickness that rises along x, y and both, times 3.
    turning : (8, J, J) float64
        Turns by moments, for each edge and its slope.
    tense : (3, n, n) float64
        Products with uniform stresses xx, yy and xy of 1 N/mm.
    stretching : (M + U, n (n + 1) / 2) float32
        Products with the stresses, then what gives the drifts: lower triangles.
    shaped : (S, M + U, n) float64
        The same with a shape of 1 mm.
    easing : (27, M, M) float64
        Complementary energy of the thickness that rises.
    giving : (8, M, M) float64
        That of the edges.
    slipping : (8, U, M) float64
        Drifts by stresses, for each edge and its slope.
    details : (2 nx + 2, 2 ny + 2, D) float64
        Unknowns of the modes beyond the first K, 1/mm, orthonormal over the plate.
    firmness : (D,) float64
        Their bending energy.
    corrections : Corrections, optional
        Where the plane bends the details too.
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
    stretching: F32
    shaped: F64
    easing: F64
    giving: F64
    slipping: F64
    details: F64
    firmness: F64
    corrections: Corrections | None = None

    def value(self, xy: F64, details: int = 0) -> F64:
        """Functions of the deflection, and some details, at points (N, 2) mm: (N, n + details)."""
        return derivative(self.mesh, xy).of(self._with(details))

    def slope(self, xy: F64, details: int = 0) -> F64:
        """Their slopes along x and y: (N, n + details, 2)."""
        values = self._with(details)
        slopes = [derivative(self.mesh, xy, *order).of(values) for order in ((1, 0), (0, 1))]
        return np.stack(slopes, axis=2)

    def _with(self, details: int) -> F64:
        return np.concatenate([self.values, self.details[..., :details]], axis=2)

    @property
    def turns(self) -> int:
        """Number of turns of the edges, J."""
        return self.turning.shape[1]

    @cached_property
    def described(self) -> F64:
        """Parameters (54,) that the description gives: tension, shape and how its edges give.

        A shape is the nearest one that vanishes where edges hold.
        """
        values = np.zeros(len(NAMES))
        values[TENSION] = self.plate.tension
        if self.plate.shape is not None:
            values[SHAPE] = nearest(self.plate, self.mesh, self.plate.shape)
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
        if self.corrections is not None:
            named |= {f"corrections_{name}": getattr(self.corrections, name) for name in _PRODUCTS}
        return store(self.plate, self.mesh, **named)

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> ModalPlate:
        """Build the plate that `arrays` wrote.

        Raises
        ------
        ValueError
            An array is missing or has the wrong shape.
        """
        corrected = [f"corrections_{name}" for name in _PRODUCTS]
        corrected = corrected if corrected[0] in arrays else []
        plate, mesh, found = restore(arrays, *_STORED, *corrected)
        named: dict[str, Any] = dict(zip(_STORED, found, strict=False))
        named["count"] = int(named["count"])
        corrections = Corrections(*found[len(_STORED) :]) if corrected else None
        return cls(plate, mesh, **named, corrections=corrections)


_APART = "plate", "mesh", "corrections"
_PRODUCTS = tuple(field.name for field in fields(Corrections))
_STORED = tuple(field.name for field in fields(ModalPlate) if field.name not in _APART)

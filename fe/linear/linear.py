"""Small deflections: Kirchhoff's plate under touches and other loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64, AnyArray, Mask
from fe.elements.factor import Factor, factor
from fe.elements.functional import derivative, recovered
from fe.elements.mesh import Mesh, mesh_for
from fe.elements.nodal_loads import nodal_loads
from fe.elements.resolution import unresolved
from fe.linear.buckling import check_buckling
from fe.linear.demand import OVERSTRAINED, strain_demand
from fe.linear.energy import free, stiffness
from fe.linear.load import spread
from fe.linear.mesh_error import MeshError, error_of, less_mesh
from fe.linear.touch_mesh import touch_mesh
from fe.plate.loads import Load, acts_along, singular_places
from fe.plate.plate import Plate, Touch
from fe.plate.thin import check_thin

Face = Literal["top", "middle", "bottom"]

FACES: tuple[Face, Face, Face] = ("top", "middle", "bottom")

# Height of a face in thicknesses, along z out of the touched face.
_HEIGHT: dict[Face, float] = {"top": 0.5, "middle": 0.0, "bottom": -0.5}

# Orders of derivative by x and y of the curvatures behind exx, eyy, exy.
CURVATURES = ((2, 0), (0, 2), (1, 1))


@dataclass(frozen=True, eq=False)
class LinearState:
    """A bent plate.

    Attributes
    ----------
    plate : Plate
    mesh : Mesh
    values : (2 nx + 2, 2 ny + 2, 1) float64, mm, read only
        Unknowns of the deflection w along +z.
    touches : tuple of Touch
        What presses, as far as it is known: beside a point force strain is not a number.
    loads : tuple of Load
        What acts beside touches, as far as it is known.
    """

    plate: Plate
    mesh: Mesh
    values: F64
    touches: tuple[Touch, ...] = ()
    loads: tuple[Load, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", self.mesh.table(self.values, 1))

    def deflection(self, xy: ArrayLike) -> F64:
        """Deflection w at points (K, 2) mm: (K,) float64, mm along +z, negative under a press."""
        return self._derivative(self.plate.points(xy), 0, 0)

    def slope(self, xy: ArrayLike) -> F64:
        """Slopes w,x and w,y at points (K, 2) mm: (K, 2) float64."""
        xy = self.plate.points(xy)
        return np.stack([self._derivative(xy, 1, 0), self._derivative(xy, 0, 1)], axis=1)

    def displacement(self, xy: ArrayLike, face: Face = "top") -> F64:
        """Displacement of a face at points (K, 2) mm of the flat plate.

        Normals stay straight and normal (Kirchhoff): u = -z w,x and v = -z w,y.

        Returns
        -------
        (K, 3) float64, mm
            u, v, w.

        Raises
        ------
        ValueError
            The face is not "top", "middle" or "bottom", or a point is not on the plate.
        """
        xy = self.plate.points(xy)
        z = height(self.plate, xy, face)
        return np.column_stack([-z[:, None] * self.slope(xy), self.deflection(xy)])

    def strain(self, xy: ArrayLike, face: Face = "top") -> F64:
        """Small strain of a face at points (K, 2) mm, with an error of h⁴.

        Returns
        -------
        (K, 3) float64, strain
            exx, eyy and the tensor component exy; not a number `near_touch`.

        Raises
        ------
        ValueError
            As for `displacement`.
        """
        xy = self.plate.points(xy)
        curvature = [recovered(self.mesh, xy, p, q).of(self.values)[:, 0] for p, q in CURVATURES]
        strain = -height(self.plate, xy, face)[:, None] * np.stack(curvature, axis=1)
        strain[self.near_touch(xy)] = np.nan
        return strain

    def near_touch(self, xy: ArrayLike) -> Mask:
        """Whether points (K, 2) mm lie so near to a point force that strain is not resolved."""
        points = (*self.touches, *singular_places(self.loads))
        return unresolved(self.plate, self.mesh, points, self.plate.points(xy))

    def mesh_error(self, xy: ArrayLike, face: Face = "top") -> MeshError:
        """Estimate how far deflection and strain at points (K, 2) mm are off because of the mesh.

        Bends the plate once more, on two thirds of the elements.
        """
        less = Linear(self.plate, less_mesh(self.mesh)).deflect(self.touches, self.loads)
        return error_of(self, replace(less, touches=(), loads=()), xy, face)

    @cached_property
    def demand(self) -> float:
        """Largest equivalent strain of the faces in parts of the strain limit of the material.

        Beside point forces, where strain is not a number, it is left out.
        """
        return strain_demand(self)

    @property
    def caution(self) -> str:
        """What is wrong with the state, for the user; empty where the material bears it."""
        return OVERSTRAINED if self.demand > 1.0 else ""

    def _derivative(self, xy: F64, p: int, q: int) -> F64:
        return derivative(self.mesh, xy, p, q).of(self.values)[:, 0]


def check_flat(plate: Plate) -> None:
    """Raise where a plate has a shape, which linear theory does not know."""
    if plate.shape is not None:
        raise ValueError(
            f"linear theory is that of a flat plate, got {plate.shape}; use the reduced plate or "
            "the shell"
        )


def height(plate: Plate, xy: F64, face: Face) -> F64:
    """Height z of a face over the middle plane at points (K, 2) mm: (K,) float64, mm.

    Raises
    ------
    ValueError
        The face is not "top", "middle" or "bottom".
    """
    if face not in _HEIGHT:
        raise ValueError(f"face must be one of {', '.join(_HEIGHT)}, got {face!r}")
    return _HEIGHT[face] * plate.material(xy)[0]


@dataclass(frozen=True, eq=False)
class Linear:
    """A plate ready for many loads: the stiffness is factored once, at the first.

    Tension at rest stiffens it. A plate with a shape stretches as soon as it deflects, which this
    theory leaves out: it is refused.

    Attributes
    ----------
    plate : Plate
        Flat.
    mesh : Mesh
        Of the size of the plate.

    Raises
    ------
    ValueError
        The mesh does not fit the plate, or the plate has a shape.
    """

    plate: Plate
    mesh: Mesh

    def __post_init__(self) -> None:
        check_flat(self.plate)
        mesh_for(self.plate, self.mesh)

    @cached_property
    def factor(self) -> Factor:
        """Factors of the stiffness of the unknowns that the edges leave free.

        Raises
        ------
        ValueError
            The edges or a patch are so soft that rounding would show in the result, or the plate
            buckles under its tension.
        """
        check_buckling(self.plate)
        return factor(stiffness(self.plate, self.mesh))

    @cached_property
    def free(self) -> tuple[AnyArray, AnyArray]:
        """Index of the rows and columns of the table that the edges leave free."""
        rows, columns = np.ix_(*free(self.plate, self.mesh))
        return rows, columns

    def solve(self, loads: F64) -> F64:
        """Unknowns under generalised nodal loads.

        Parameters
        ----------
        loads : (2 nx + 2, 2 ny + 2, C) float64, N
            What the edges hold is not read.

        Returns
        -------
        (2 nx + 2, 2 ny + 2, C) float64, mm
        """
        right = loads[self.free]
        values = np.zeros(loads.shape)
        solution = self.factor.solve(right.reshape(-1, right.shape[2]))
        values[self.free] = solution.reshape(right.shape)
        return values

    def deflect(self, touches: Sequence[Touch], loads: Sequence[Load] = ()) -> LinearState:
        """Bend the plate by touches and other loads.

        Raises
        ------
        ValueError
            A touch or load lies outside the plate, a load acts along the plate, or the plate is
            thick.
        """
        check_thin(self.plate)
        for load in loads:
            if acts_along(load):
                raise ValueError(
                    f"linear theory bends the plate and does not stretch it, got {load}; use"
                    " fe.solve for forces along the plate"
                )
        xy, along_z, _ = spread(self.plate, self.mesh, touches)
        work = nodal_loads(self.plate, self.mesh, loads)[:, :, 2:].copy()
        derivative(self.mesh, xy).add_to(work, along_z, np.zeros(len(xy), dtype=np.int64))
        values = self.solve(work)
        return LinearState(self.plate, self.mesh, values, tuple(touches), tuple(loads))


def deflect(
    plate: Plate,
    touches: Sequence[Touch],
    mesh: Mesh | None = None,
    loads: Sequence[Load] = (),
) -> LinearState:
    """Bend a plate by touches and other loads, linearly.

    Deflections must stay small against the thickness: strain is off by 1 % where the deflection
    reaches 0.02 to 0.05 of it, for then the middle of the plate stretches too. What the material
    does not bear is computed all the same, and the state's `caution` says so.

    Parameters
    ----------
    plate : Plate
    touches : sequence of Touch
    mesh : Mesh, optional
        If left out one that is fine where the plate is touched or loaded, or `default_mesh(plate)`
        where a square is so at many places. For many loads on one plate keep a `Linear`.
    loads : sequence of Load, optional
        Pressure, line loads and moments beside the touches.

    Raises
    ------
    ValueError
        A touch or load lies outside the plate, a load acts along the plate, the mesh has another
        size, or the plate has a shape or is thick.
    """
    if mesh is None:
        mesh = touch_mesh(plate, touches, loads)
    return Linear(plate, mesh_for(plate, mesh)).deflect(touches, loads)

"""Small deflections: Kirchhoff's plate under point loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.linalg import SuperLU, splu

from fe.energy import CLAMPED, bending_stiffness
from fe.functional import derivative, recovered
from fe.mesh import Mesh, mesh_for
from fe.plate import Plate, Touch

Face = Literal["top", "middle", "bottom"]

# Height of a face in thicknesses, along z out of the touched face.
_HEIGHT: dict[Face, float] = {"top": 0.5, "middle": 0.0, "bottom": -0.5}

# Orders of derivative by x and y of the curvatures behind exx, eyy, exy.
CURVATURES = ((2, 0), (0, 2), (1, 1))


@dataclass(frozen=True, eq=False)
class State:
    """A bent plate.

    Attributes
    ----------
    plate : Plate
    mesh : Mesh
    values : (2 nx + 2, 2 ny + 2, 1) float64, mm, read only
        Unknowns of the deflection w along +z.
    """

    plate: Plate
    mesh: Mesh
    values: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", self.mesh.table(self.values, 1))

    def deflection(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Deflection w at points (K, 2) mm: (K,) float64, mm along +z, negative under a press."""
        return self._derivative(self.plate.points(xy), 0, 0)

    def slope(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Slopes w,x and w,y at points (K, 2) mm: (K, 2) float64."""
        xy = self.plate.points(xy)
        return np.stack([self._derivative(xy, 1, 0), self._derivative(xy, 0, 1)], axis=1)

    def displacement(self, xy: ArrayLike, face: Face = "top") -> NDArray[np.float64]:
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
        if face not in _HEIGHT:
            raise ValueError(f"face must be one of {', '.join(_HEIGHT)}, got {face!r}")
        z = _HEIGHT[face] * self.plate.thickness
        return np.column_stack([-z * self.slope(xy), self.deflection(xy)])

    def strain(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Small strain of the touched face at points (K, 2) mm, with an error of h⁴.

        Returns
        -------
        (K, 3) float64, strain
            exx, eyy and the tensor component exy.
        """
        xy = self.plate.points(xy)
        curvature = [recovered(self.mesh, xy, p, q).of(self.values)[:, 0] for p, q in CURVATURES]
        return -0.5 * self.plate.thickness * np.stack(curvature, axis=1)

    def _derivative(self, xy: NDArray, p: int, q: int) -> NDArray[np.float64]:
        return derivative(self.mesh, xy, p, q).of(self.values)[:, 0]


@dataclass(frozen=True, eq=False)
class Linear:
    """A plate ready for many loads: the stiffness is factored once, at the first.

    Attributes
    ----------
    plate : Plate
    mesh : Mesh
        Of the size of the plate.
    """

    plate: Plate
    mesh: Mesh

    def __post_init__(self) -> None:
        mesh_for(self.plate, self.mesh)

    @cached_property
    def factor(self) -> SuperLU:
        """Factors of the stiffness of the unknowns that the edges leave free."""

        def along(axis: int):
            return lambda p, q: self.mesh.gram(axis, p, q)[CLAMPED, CLAMPED]

        stiffness = bending_stiffness(self.plate, along(0), along(1), sp.kron)
        # Symmetric and positive: no pivoting, and minimum degree on the pattern itself.
        return splu(
            sp.csc_array(stiffness),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    def solve(self, loads: NDArray[np.float64]) -> NDArray[np.float64]:
        """Unknowns under generalised nodal loads.

        Parameters
        ----------
        loads : (2 nx + 2, 2 ny + 2, C) float64, N
            What the edges hold is not read.

        Returns
        -------
        (2 nx + 2, 2 ny + 2, C) float64, mm
        """
        free = loads[CLAMPED, CLAMPED]
        values = np.zeros(loads.shape)
        solution = self.factor.solve(free.reshape(-1, free.shape[2]))
        values[CLAMPED, CLAMPED] = solution.reshape(free.shape)
        return values

    def deflect(self, touches: Sequence[Touch]) -> State:
        """Bend the plate by touches.

        Raises
        ------
        ValueError
            A touch lies outside the plate.
        """
        places = np.array([(t.x, t.y) for t in touches], dtype=np.float64).reshape(-1, 2)
        xy = self.plate.points(places, "touch")
        # A force into the plate acts along -z.
        along_z = np.array([-t.force for t in touches], dtype=np.float64)
        loads = np.zeros((*self.mesh.shape, 1))
        derivative(self.mesh, xy).add_to(loads, along_z, np.zeros(len(xy), dtype=np.int64))
        return State(self.plate, self.mesh, self.solve(loads))


def deflect(plate: Plate, touches: Sequence[Touch], mesh: Mesh | None = None) -> State:
    """Bend a plate by touches, linearly.

    Deflections must stay small against the thickness: strain is off by 1 % where the deflection
    reaches 0.02 to 0.05 of it, for then the middle of the plate stretches too.

    Parameters
    ----------
    plate : Plate
    touches : sequence of Touch
    mesh : Mesh, optional
        `default_mesh(plate)` if left out. For many loads on one plate keep a `Linear`.

    Raises
    ------
    ValueError
        A touch lies outside the plate, or the mesh has another size.
    """
    return Linear(plate, mesh_for(plate, mesh)).deflect(touches)

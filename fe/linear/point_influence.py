"""How a face of the plate moves at given points for a touch at any place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64
from fe.elements.functional import derivative
from fe.elements.mesh import Mesh, mesh_for
from fe.elements.storage import restore, store
from fe.linear.adjoint import Adjoint, solve_adjoint
from fe.linear.linear import FACES, Face, Linear, height
from fe.linear.mesh_error import left, less_mesh, under_touches
from fe.plate.plate import Plate, Touch
from fe.plate.thin import check_thin

# Orders of derivative of w behind u, v, w.
_ORDERS = ((1, 0), (0, 1), (0, 0))


@dataclass(frozen=True, eq=False)
class DisplacementInfluence:
    """Displacement of M points of a face for a touch of 1 N, as functions of its place.

    Attributes
    ----------
    adjoint : Adjoint
        Of 3 M channels: u, v, w of the first point, then of the second, ...
    at : (M, 2) float64, mm, read only
        The points, where they lie on the flat plate.
    face : str
        On which they lie, "top", "middle" or "bottom".
    """

    adjoint: Adjoint
    at: F64
    face: Face = "top"

    def __post_init__(self) -> None:
        at = self.plate.points(self.at).copy()
        at.flags.writeable = False
        object.__setattr__(self, "at", at)
        self.mesh.table(self.adjoint.values, 3 * len(at))

    @property
    def plate(self) -> Plate:
        """The plate."""
        return self.adjoint.plate

    @property
    def mesh(self) -> Mesh:
        """The grid of its elements."""
        return self.adjoint.mesh

    def displacement(self, xy: ArrayLike, radius: float = 0.0) -> F64:
        """Displacement of every point for a touch of 1 N at each place (K, 2) mm.

        Returns
        -------
        (K, M, 3) float64, mm per N
            u, v, w.

        Raises
        ------
        ValueError
            A place, or a disc of `radius` mm about it, lies outside the plate.
        """
        moved = self.adjoint.read(xy, radius)
        return moved.reshape(len(moved), len(self.at), 3)

    def gradient(self, xy: ArrayLike, radius: float = 0.0) -> F64:
        """Exact derivative of `displacement` by the place: (K, M, 3, 2) float64, 1/N."""
        gradient = self.adjoint.gradient(xy, radius)
        return gradient.reshape(len(gradient), len(self.at), 3, 2)

    def mesh_error(self, xy: ArrayLike, radius: float = 0.0) -> F64:
        """Estimate how far `displacement` is off by the mesh: (K, M, 3) float64, mm per N.

        Solves every point once more, on two thirds of the elements.
        """
        mesh = less_mesh(self.mesh)
        less = displacement_influence(self.plate, self.at, mesh, None, self.face)
        found = left(self.displacement(xy, radius), less.displacement(xy, radius))
        touches = [Touch(x, y, 1.0, radius) for x, y in self.plate.points(xy, "touch").tolist()]
        near = [under_touches(self.plate, self.mesh, [touch], self.at) for touch in touches]
        found[:, :, 2] = np.maximum(found[:, :, 2], np.array(near).reshape(found.shape[:2]))
        return found

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all of it as named arrays, for a file."""
        face = np.array(FACES.index(self.face))
        return store(self.plate, self.mesh, at=self.at, values=self.adjoint.values, face=face)

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> DisplacementInfluence:
        """Build the influence that `arrays` wrote.

        Raises
        ------
        ValueError
            An array is missing or has the wrong shape.
        """
        known = {"face": np.array(0), **arrays}
        plate, mesh, (at, values, face) = restore(known, "at", "values", "face")
        return cls(Adjoint(plate, mesh, values), at, FACES[int(face)])


def displacement_influence(
    plate: Plate,
    points: ArrayLike,
    mesh: Mesh | None = None,
    progress: Callable[[int, int], object] | None = None,
    face: Face = "top",
) -> DisplacementInfluence:
    """Solve once for each displacement of a point, and know it for a touch anywhere.

    Parameters
    ----------
    plate : Plate
    points : (M, 2) array_like, mm
        Places on the flat plate.
    mesh, progress
        As for `influence`.
    face : str
        "top", the touched one, "middle" or "bottom".

    Returns
    -------
    DisplacementInfluence

    Raises
    ------
    ValueError
        A point lies outside the plate, or the mesh does not fit.
    """
    at = plate.points(points)
    check_thin(plate)
    linear = Linear(plate, mesh_for(plate, mesh))
    z = height(plate, at, face)
    # u = -z w,x and v = -z w,y; a touch of 1 N is -1 N along z.
    scale = np.column_stack([z, z, -np.ones(len(at))]).ravel()
    return DisplacementInfluence(
        solve_adjoint(linear, at, _ORDERS, derivative, scale, progress), at, face
    )

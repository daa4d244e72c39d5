"""The plate under large touches, as the reduced plate finds it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64, Mask
from fe.elements.functional import derivative
from fe.elements.mesh import Mesh
from fe.linear.linear import Face, LinearState
from fe.linear.load import spread
from fe.linear.mesh_error import MeshError, more_mesh, over, under_touches
from fe.plate.plate import Plate
from fe.reduced.basis import at_nodes
from fe.reduced.interpolation import between
from fe.reduced.karman import Karman
from fe.reduced.result import Trust

_BALANCED = 1e-6  # of the load


@dataclass(frozen=True, eq=False)
class LargeState:
    """A plate that bends and stretches.

    Attributes
    ----------
    bent : LinearState
        Its deflection.
    plane : (2, 2 nx + 2, 2 ny + 2, 1) float64, mm
        Unknowns of u and v of the middle surface.
    stress : (nx + 1, ny + 1, 3, 1) float64, N/mm
        Nxx, Nyy, Nxy in the plane at the nodes.
    result : Trust
    """

    bent: LinearState
    plane: F64
    stress: F64
    result: Trust

    @property
    def plate(self) -> Plate:
        """The plate."""
        return self.bent.plate

    @property
    def mesh(self) -> Mesh:
        """The grid of its elements."""
        return self.bent.mesh

    @property
    def converged(self) -> bool:
        """Whether a balance was found."""
        return self.result is not Trust.NOT_CONVERGED

    def deflection(self, xy: ArrayLike) -> F64:
        """Deflection w at points (K, 2) mm: (K,) float64, mm along +z, negative under a press."""
        return self.bent.deflection(xy)

    def displacement(self, xy: ArrayLike, face: Face = "top") -> F64:
        """Displacement u, v, w of a face at points (K, 2) mm of the flat plate: (K, 3) float64, mm.

        The middle surface moves in the plane as it stretches, and normals turn by the slopes.

        Raises
        ------
        ValueError
            The face is not "top", "middle" or "bottom", or a point is not on the plate.
        """
        moved = self.bent.displacement(xy, face)
        moved[:, :2] += drift_at(self.mesh, self.plane, self.plate.points(xy))[:, :, 0]
        return moved

    def strain(self, xy: ArrayLike, face: Face = "top") -> F64:
        """Green-Lagrange strain of a face at points (K, 2) mm, to von Kármán's order.

        Returns
        -------
        (K, 3) float64, strain
            exx, eyy and the tensor component exy.

        Raises
        ------
        ValueError
            As for `displacement`.
        """
        xy = self.plate.points(xy)
        middle = middle_strain(self.plate, self.mesh, self.stress, xy)
        return self.bent.strain(xy, face) + middle[:, :, 0]

    def near_touch(self, xy: ArrayLike) -> Mask:
        """Whether points (K, 2) mm lie so near to a point force that strain is not resolved."""
        return self.bent.near_touch(xy)

    def mesh_error(self, xy: ArrayLike, face: Face = "top") -> MeshError:
        """Estimate how far deflection and strain at points (K, 2) mm are off.

        By the mesh, and by what the reduced plate leaves out. At the first call the whole plate is
        solved on one and a half times the elements along each side, which takes seconds.

        Raises
        ------
        ValueError
            The whole plate finds no balance under these touches.
        """
        xy = self.plate.points(xy)
        near = under_touches(self.plate, self.mesh, self.bent.touches, xy)
        deflection = over(self.deflection(xy), self._on_more.deflection(xy))
        strain = over(self.strain(xy, face), self._on_more.strain(xy, face))
        return MeshError(np.maximum(deflection, near), strain)

    @cached_property
    def _on_more(self) -> LargeState:
        """The whole plate under the same touches, on more elements."""
        karman = Karman(self.plate, more_mesh(self.mesh))
        xy, along_z, _ = spread(self.plate, karman.mesh, self.bent.touches)
        loads = np.zeros((*karman.mesh.shape, 1))
        derivative(karman.mesh, xy).add_to(loads, along_z, np.zeros(len(xy), dtype=np.int64))
        found = karman.solve(loads, _BALANCED)
        if not found.residual <= _BALANCED:
            raise ValueError(
                "error of a reduced state needs a balance of the whole plate, got a residual of "
                f"{found.residual:.2g} of the load; press less"
            )
        # Without its touches: where this state resolves the strain the other one is read too.
        bent = LinearState(self.plate, karman.mesh, found.values)
        stress = at_nodes(karman, found.plane.stress)
        return LargeState(bent, found.plane.values, stress, self.result)


def drift_at(mesh: Mesh, plane: F64, xy: F64) -> F64:
    """Displacements u, v of C states (2, 2 nx + 2, 2 ny + 2, C) mm at points: (K, 2, C)."""
    read = derivative(mesh, xy)
    return np.stack([read.of(np.ascontiguousarray(part)) for part in plane], axis=1)


def middle_strain(plate: Plate, mesh: Mesh, stress: F64, xy: F64) -> F64:
    """Strain exx, eyy, exy of the middle surface from C stresses at the nodes.

    Parameters
    ----------
    plate : Plate
    mesh : Mesh
    stress : (nx + 1, ny + 1, 3, C) float64, N/mm
    xy : (K, 2) float64, mm

    Returns
    -------
    (K, 3, C) float64
    """
    x, y = (between(nodes, xy[:, axis]) for axis, nodes in enumerate(mesh.nodes))
    along = np.tensordot(x, stress, 1)
    xx, yy, xy_ = np.einsum("kj,kjcm->ckm", y, along)
    thickness, young = plate.material(xy)
    nu, soft = plate.poisson, 1.0 / (young * thickness)[:, None]
    return np.stack([soft * (xx - nu * yy), soft * (yy - nu * xx), soft * (1 + nu) * xy_], axis=1)

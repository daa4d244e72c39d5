"""A bent shell in equilibrium, and what can be read from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64, Mask
from fe.elements.functional import derivative, recovered
from fe.elements.mesh import Mesh
from fe.elements.nodal_loads import nodal_loads
from fe.elements.resolution import unresolved
from fe.linear.linear import Face, height
from fe.linear.load import spread
from fe.linear.mesh_error import MeshError, error_of
from fe.plate.loads import Load, singular_places
from fe.plate.plate import Plate, Touch
from fe.shell.base import Base
from fe.shell.measure import Reading, derivatives, rest, strain, surface
from fe.shell.stability import Stability

if TYPE_CHECKING:
    from fe.shell.shell import Shell


@dataclass(frozen=True, eq=False)
class ShellState:
    """A plate bent far: its displacement, strain and stress are those from rest on.

    Attributes
    ----------
    shell : Shell
    base : Base
        Where the clamps are.
    values : (2 nx + 2, 2 ny + 2, 3) float64, mm, read only
        Unknowns of the displacement u, v, w of the middle surface.
    loads : (2 nx + 2, 2 ny + 2, 3) float64, N, read only
        Dead loads on them.
    stability : Stability
        Whether this is an equilibrium, and how far from a limit. Look at it before anything else.
    touches : tuple of Touch
        What presses: beside a point force strain is not a number.
    applied : tuple of Load
        What acts beside touches, as far as it is known: beside a point strain is not a number.
    beside : bool
        Whether loads act that are none of these.
    """

    shell: Shell
    base: Base
    values: F64
    loads: F64
    stability: Stability
    touches: tuple[Touch, ...] = ()
    applied: tuple[Load, ...] = ()
    beside: bool = False

    def __post_init__(self) -> None:
        for name in ("values", "loads"):
            object.__setattr__(self, name, self.mesh.table(getattr(self, name), 3))

    @property
    def plate(self) -> Plate:
        """The plate."""
        return self.shell.plate

    @property
    def mesh(self) -> Mesh:
        """Its grid."""
        return self.shell.mesh

    @cached_property
    def energy(self) -> float:
        """Elastic energy of the plate and its edges from rest, N mm."""
        return self.shell.system.forces(self.values.ravel())[0]

    def deflection(self, xy: ArrayLike) -> F64:
        """Deflection w at points (K, 2) mm: (K,) float64, mm along +z, negative under a press."""
        return derivative(self.mesh, self.plate.points(xy)).of(self.values)[:, 2]

    def normal(self, xy: ArrayLike) -> F64:
        """Return the normals (K, 3) of the touched face at points (K, 2) mm of the flat plate."""
        return surface(self.place(self.plate.points(xy), derivative)).normal

    def displacement(self, xy: ArrayLike, face: Face = "top") -> F64:
        """Displacement of a face at points (K, 2) mm of the flat plate.

        The middle surface moves by U and its normal turns from N to n: U + z (n - N).

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
        z = height(self.plate, xy, face)[:, None]
        middle = derivative(self.mesh, xy).of(self.values)
        return middle + z * (self.normal(xy) - surface(rest(self.plate, xy)).normal)

    def strain(self, xy: ArrayLike, face: Face = "top") -> F64:
        """Green-Lagrange strain of a face at points (K, 2) mm of the flat plate.

        The strain of the `displacement` of that face from rest, of stretch and of bending.

        Returns
        -------
        (K, 3) float64, strain
            exx, eyy and the tensor component exy, in the axes of the flat plate; not a number
            `near_touch`.

        Raises
        ------
        ValueError
            As for `displacement`.
        """
        xy = self.plate.points(xy)
        z = height(self.plate, xy, face)
        found = strain(self.place(xy, recovered), z) - strain(rest(self.plate, xy), z)
        found[self.near_touch(xy)] = np.nan
        return found

    def near_touch(self, xy: ArrayLike) -> Mask:
        """Whether points (K, 2) mm lie so near to a point force that strain is not resolved."""
        points = (*self.touches, *singular_places(self.applied))
        return unresolved(self.plate, self.mesh, points, self.plate.points(xy))

    def mesh_error(self, xy: ArrayLike, face: Face = "top") -> MeshError:
        """Estimate how far deflection and strain at points (K, 2) mm are off because of the mesh.

        Solves once more on two thirds of the elements, at the first call: base, touches, all
        pressed at once, and then what else is applied.

        Raises
        ------
        ValueError
            Nodal loads act whose work on fewer elements is not known, or no equilibrium was found
            on two thirds of the elements.
        """
        return error_of(self, replace(self.on_less, touches=(), applied=()), xy, face)

    @cached_property
    def on_less(self) -> ShellState:
        """The same state on two thirds of the elements, solved when it is first asked for.

        Raises
        ------
        ValueError
            As for `mesh_error`.
        """
        if self.beside:
            raise ValueError(
                "error of the mesh is that of a base, touches and applied loads, got nodal loads "
                "beside them; solve on two meshes and compare"
            )
        less = self.shell.coarser.at(self.base)
        if self.touches:
            less = less.touch(self.touches)
        if self.applied:
            less = less.apply(self.applied)
        if not less.stability.converged:
            raise ValueError(
                "error of the mesh needs an equilibrium on fewer elements too, got "
                f"{less.mesh.counts} elements and none; give a finer mesh"
            )
        return less

    def touch(self, touches: Sequence[Touch]) -> ShellState:
        """Press further: the state with these touches beside the loads that are there.

        Each force presses against the normal that this state has at its place, and keeps that
        direction while the plate yields.

        Raises
        ------
        ValueError
            A touch lies outside the plate.
        """
        xy, along_z, _ = spread(self.plate, self.mesh, touches)
        loads = np.zeros(self.loads.shape)
        here, normal = derivative(self.mesh, xy), self.normal(xy)
        for c in range(3):
            one = np.full(len(xy), c, dtype=np.int64)
            here.add_to(loads, along_z * normal[:, c], one)
        return self.shell.loaded(self, loads, tuple(touches))

    def apply(self, loads: Sequence[Load]) -> ShellState:
        """Add pressure, lines, forces along the face and moments to what is there.

        They keep the direction that they have on the plate at rest.

        Raises
        ------
        ValueError
            A load lies outside the plate.
        """
        work = nodal_loads(self.plate, self.mesh, loads)
        return self.shell.loaded(self, work, applied=tuple(loads))

    def load(self, loads: F64) -> ShellState:
        """Add dead loads: the state with these beside the ones that are there.

        Parameters
        ----------
        loads : (2 nx + 2, 2 ny + 2, 3) float64, N
            Work of the load on each unknown. What the edges hold is not read.
        """
        return self.shell.loaded(self, self.mesh.table(loads, 3))

    def place(self, xy: F64, reading: Reading) -> F64:
        """Read the derivatives of the place of the surface, less those of the plane: (K, 5, 3)."""
        return rest(self.plate, xy) + derivatives(self.mesh, self.values, xy, reading)

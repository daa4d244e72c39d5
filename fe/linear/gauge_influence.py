"""What each gauge reads for a touch at any place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64, Mask
from fe.elements.functional import Functional, averaged, recovered
from fe.elements.mesh import Mesh, mesh_for
from fe.elements.resolution import unresolved
from fe.elements.storage import restore, store
from fe.linear.adjoint import Adjoint, solve_adjoint
from fe.linear.linear import CURVATURES, FACES, Face, Linear, height
from fe.linear.mesh_error import left, less_mesh
from fe.linear.touch_mesh import gauge_mesh
from fe.plate.checks import number
from fe.plate.plate import Plate, Touch
from fe.plate.thin import check_thin


@dataclass(frozen=True, eq=False)
class Influence:
    """Strain of M gauges for a touch of 1 N, as functions of its place.

    Attributes
    ----------
    adjoint : Adjoint
        Of 3 M channels: exx, eyy, exy of the first gauge, then of the second, ...
    gauges : (M, 2) float64, mm, read only
    face : str
        On which they lie, "top", "middle" or "bottom".
    length : float, mm
        Side of the square over which they average; 0 for points.
    """

    adjoint: Adjoint
    gauges: F64
    face: Face = "top"
    length: float = 0.0

    def __post_init__(self) -> None:
        gauges = self.plate.points(self.gauges, "gauge").copy()
        gauges.flags.writeable = False
        object.__setattr__(self, "gauges", gauges)
        self.mesh.table(self.adjoint.values, 3 * len(gauges))

    @property
    def plate(self) -> Plate:
        """The plate."""
        return self.adjoint.plate

    @property
    def mesh(self) -> Mesh:
        """The grid of its elements."""
        return self.adjoint.mesh

    def strain(self, xy: ArrayLike, radius: float = 0.0) -> F64:
        """Strain of every gauge for a touch of 1 N at each place (K, 2) mm.

        Returns
        -------
        (K, M, 3) float64, strain per N
            exx, eyy and the tensor component exy.

        Raises
        ------
        ValueError
            A place, or a disc of `radius` mm about it, lies outside the plate.
        """
        strain = self.adjoint.read(xy, radius)
        return strain.reshape(len(strain), len(self.gauges), 3)

    def gradient(self, xy: ArrayLike, radius: float = 0.0) -> F64:
        """Exact derivative of `strain` by the place of the touch.

        Returns
        -------
        (K, M, 3, 2) float64, strain per N per mm
            Last axis d/dx, d/dy.
        """
        gradient = self.adjoint.gradient(xy, radius)
        return gradient.reshape(len(gradient), len(self.gauges), 3, 2)

    def near_gauge(self, xy: ArrayLike, radius: float = 0.0) -> Mask:
        """Whether a touch lies so near to a gauge that its strain is one of the mesh.

        Estimators ask for every place, so that `strain` has a number there all the same: within
        two elements of a gauge at a point, under a touch on a point, it stands for nothing.

        Returns
        -------
        (K, M) bool
            Never for gauges that average over a length.
        """
        xy = self.plate.points(xy, "touch")
        if self.length > 0:
            return np.zeros((len(xy), len(self.gauges)), dtype=bool)
        near = [
            unresolved(self.plate, self.mesh, [Touch(x, y, 1.0, radius)], self.gauges)
            for x, y in xy.tolist()
        ]
        return np.array(near).reshape(len(xy), len(self.gauges))

    def mesh_error(self, xy: ArrayLike, radius: float = 0.0) -> F64:
        """Estimate how far `strain` is off because of the mesh: (K, M, 3) float64, strain per N.

        Solves every gauge once more, on two thirds of the elements.
        """
        mesh = less_mesh(self.mesh)
        less = influence(self.plate, self.gauges, mesh, None, self.face, self.length)
        return left(self.strain(xy, radius), less.strain(xy, radius))

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all of it as named arrays, for a file."""
        return store(
            self.plate,
            self.mesh,
            gauges=self.gauges,
            values=self.adjoint.values,
            face=np.array(FACES.index(self.face)),
            length=np.array(self.length),
        )

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> Influence:
        """Build the influence that `arrays` wrote.

        Raises
        ------
        ValueError
            An array is missing or has the wrong shape.
        """
        before = {"face": np.array(0), "length": np.array(0.0)}
        known = {**arrays, **{name: value for name, value in before.items() if name not in arrays}}
        plate, mesh, found = restore(known, "gauges", "values", "face", "length")
        gauges, values, face, length = found
        return cls(Adjoint(plate, mesh, values), gauges, FACES[int(face)], float(length))


def influence(
    plate: Plate,
    gauges: ArrayLike,
    mesh: Mesh | None = None,
    progress: Callable[[int, int], object] | None = None,
    face: Face = "top",
    length: float = 0.0,
) -> Influence:
    """Solve once for each strain of a gauge, and know it for a touch anywhere.

    Parameters
    ----------
    plate : Plate
    gauges : (M, 2) array_like, mm
        Places of the gauges.
    mesh : Mesh, optional
        If left out one that is fine at the gauges, or `default_mesh(plate)` where a square has
        many.
    progress : callable, optional
        Called with the strains done and their number.
    face : str
        "top", the touched one, or "bottom".
    length : float, mm
        Side of the square over which a gauge averages, as a virtual strain gauge does; 0 for the
        strain at a point.

    Returns
    -------
    Influence

    Raises
    ------
    ValueError
        A gauge reaches outside the plate or over a change of thickness, the mesh does not fit, or
        the plate is thick.
    """
    gauges = plate.points(gauges, "gauge")
    check_thin(plate)
    linear = Linear(plate, gauge_mesh(plate, gauges) if mesh is None else mesh_for(plate, mesh))
    _check_windows(plate, gauges, length)

    def read(mesh: Mesh, xy: F64, p: int, q: int) -> Functional:
        return averaged(mesh, xy, length, p, q) if length > 0 else recovered(mesh, xy, p, q)

    # Strain is -z times the curvature of w, and a touch of 1 N is -1 N along z.
    lever = np.repeat(height(plate, gauges, face), 3)
    adjoint = solve_adjoint(linear, gauges, CURVATURES, read, lever, progress)
    return Influence(adjoint, gauges, face, length)


def _check_windows(plate: Plate, gauges: F64, length: float) -> None:
    if not 0 <= number(length, "gauge length", "mm") < inf:
        raise ValueError(f"gauge length must be 0 mm or more, got {length:g} mm; use 0 for a point")
    corners = gauges + 0.5 * length * np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)])[:, None]
    room = (corners >= 0) & (corners <= np.array(plate.size))
    if length > 0 and not room.all():
        k = int(np.argmin(room.all(axis=(0, 2))))
        raise ValueError(
            f"gauge {k} of length {length:g} mm must lie on the plate, got its middle at "
            f"({gauges[k, 0]:g}, {gauges[k, 1]:g}) mm; use a shorter one"
        )
    spans = _spans(plate, gauges, length)
    if length > 0 and spans.any():
        k = int(np.argmax(spans))
        raise ValueError(
            f"gauge {k} of length {length:g} mm must not reach over a change of thickness, got its "
            f"middle at ({gauges[k, 0]:g}, {gauges[k, 1]:g}) mm; use a shorter one"
        )


def _spans(plate: Plate, gauges: F64, length: float) -> Mask:
    """Whether a border of a patch of other thickness runs through the window of each gauge."""
    low, high = gauges - length / 2, gauges + length / 2
    spans = np.zeros(len(gauges), dtype=bool)
    for patch in plate.patches:
        corner, end = np.array([patch.x, patch.y]).T
        meets = ((low < end) & (high > corner)).all(axis=1)
        inside = ((low >= corner) & (high <= end)).all(axis=1)
        spans |= meets & ~inside
    return spans

"""What each gauge reads for a touch at any place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fe.functional import derivative, recovered
from fe.linear import CURVATURES, Linear
from fe.mesh import Mesh, mesh_for
from fe.plate import Plate
from fe.storage import restore, store

# Gauges a solve: enough to share the reading of the factors, few enough to show progress.
_BLOCK = 8


@dataclass(frozen=True, eq=False)
class Influence:
    """Strain of M gauges on the touched face for a touch of 1 N, as functions of its place.

    Attributes
    ----------
    plate : Plate
    mesh : Mesh
    gauges : (M, 2) float64, mm, read only
    values : (2 nx + 2, 2 ny + 2, 3 M) float64, strain per N, read only
        Unknowns of these functions, for each gauge exx, eyy, exy.
    """

    plate: Plate
    mesh: Mesh
    gauges: NDArray[np.float64]
    values: NDArray[np.float64]

    def __post_init__(self) -> None:
        gauges = self.plate.points(self.gauges, "gauge").copy()
        gauges.flags.writeable = False
        object.__setattr__(self, "gauges", gauges)
        object.__setattr__(self, "values", self.mesh.table(self.values, 3 * len(gauges)))

    def strain(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Strain of every gauge for a touch of 1 N at each place (K, 2) mm.

        Returns
        -------
        (K, M, 3) float64, strain per N
            exx, eyy and the tensor component exy.

        Raises
        ------
        ValueError
            A place lies outside the plate.
        """
        return self._derivative(self.plate.points(xy, "touch"), 0, 0)

    def gradient(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Exact derivative of `strain` by the place of the touch.

        Returns
        -------
        (K, M, 3, 2) float64, strain per N per mm
            Last axis d/dx, d/dy.
        """
        xy = self.plate.points(xy, "touch")
        return np.stack([self._derivative(xy, 1, 0), self._derivative(xy, 0, 1)], axis=-1)

    def _derivative(self, xy: NDArray, p: int, q: int) -> NDArray[np.float64]:
        strain = derivative(self.mesh, xy, p, q).of(self.values)
        return strain.reshape(len(xy), len(self.gauges), 3)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all of it as named arrays, for a file."""
        return store(self.plate, self.mesh, gauges=self.gauges, values=self.values)

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> Influence:
        """Build the influence that `arrays` wrote.

        Raises
        ------
        ValueError
            An array is missing or has the wrong shape.
        """
        plate, mesh, (gauges, values) = restore(arrays, "gauges", "values")
        return cls(plate, mesh, gauges, values)


def influence(
    plate: Plate,
    gauges: ArrayLike,
    mesh: Mesh | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Influence:
    """Solve once for each measurement, and know it for a touch anywhere.

    A gauge reads bᵀ w of the plate's unknowns w = K⁻¹ f. Since K is symmetric that is aᵀ f with
    K a = b, and for a touch f only evaluates a at its place: Maxwell's and Betti's reciprocity.

    Parameters
    ----------
    plate : Plate
    gauges : (M, 2) array_like, mm
        Places on the touched face.
    mesh : Mesh, optional
        `default_mesh(plate)` if left out.
    progress : callable, optional
        Called with the gauges done and their number.

    Returns
    -------
    Influence

    Raises
    ------
    ValueError
        A gauge lies outside the plate, or the mesh has another size.
    """
    gauges = plate.points(gauges, "gauge")
    linear = Linear(plate, mesh_for(plate, mesh))
    values = np.empty((*linear.mesh.shape, 3 * len(gauges)))
    for first in range(0, len(gauges), _BLOCK):
        last = min(first + _BLOCK, len(gauges))
        values[:, :, 3 * first : 3 * last] = linear.solve(_strain_loads(linear, gauges[first:last]))
        if progress is not None:
            progress(last, len(gauges))
    return Influence(plate, linear.mesh, gauges, values)


def _strain_loads(linear: Linear, gauges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Table of the functionals of gauges: strain for forces that press along -z."""
    loads = np.zeros((*linear.mesh.shape, 3 * len(gauges)))
    # Strain is -h/2 times the curvature of w, and a touch of 1 N is -1 N along z.
    lever = np.full(len(gauges), 0.5 * linear.plate.thickness)
    for component, (p, q) in enumerate(CURVATURES):
        columns = 3 * np.arange(len(gauges)) + component
        recovered(linear.mesh, gauges, p, q).add_to(loads, lever, columns)
    return loads

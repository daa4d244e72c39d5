"""What is read of a plate where no image shows all of it: linear functionals of its motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64
from fe.elements.functional import recovered
from fe.elements.mesh import Mesh
from fe.linear.linear import CURVATURES

# Small strains exx, eyy and exy by slopes of u (0) and v (1), by x (1, 0) and y (0, 1).
_SLOPES = (
    ((0, (1, 0), 1.0),),
    ((1, (0, 1), 1.0),),
    ((0, (0, 1), 0.5), (1, (1, 0), 0.5)),
)


class Readings(NamedTuple):
    """R readings of a plate on a mesh.

    Attributes
    ----------
    bent : (2 nx + 2, 2 ny + 2, R) float64
        By the unknowns of w.
    stretched : (2, 2 nx + 2, 2 ny + 2, R) float64
        By those of u and v.
    """

    bent: F64
    stretched: F64

    def of(self, deflection: F64, plane: F64) -> F64:
        """Read unknowns of w (2 nx + 2, 2 ny + 2) and of u and v (2, …), mm: (R,)."""
        bent = np.tensordot(deflection, self.bent, 2)
        return np.asarray(bent + np.tensordot(plane, self.stretched, 3), dtype=np.float64)


def strain_readings(mesh: Mesh, gauges: ArrayLike, height: float) -> Readings:
    """Small strain at gauges on a face, read as exx of all of them, then eyy, then exy.

    Parameters
    ----------
    mesh : Mesh
    gauges : (M, 2), mm
    height : float, mm
        Of the face over the middle plane.
    """
    places = np.asarray(gauges, dtype=np.float64)
    bent = np.zeros((*mesh.shape, 3 * len(places)))
    stretched = np.zeros((2, *bent.shape))
    for k, (curvature, slopes) in enumerate(zip(CURVATURES, _SLOPES, strict=True)):
        columns = np.arange(k * len(places), (k + 1) * len(places))
        recovered(mesh, places, *curvature).add_to(bent, np.full(len(places), -height), columns)
        for along, order, weight in slopes:
            scale = np.full(len(places), weight)
            recovered(mesh, places, *order).add_to(stretched[along], scale, columns)
    return Readings(bent, stretched)

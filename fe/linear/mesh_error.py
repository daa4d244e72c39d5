"""How far a state is off because of its mesh, from the same state on fewer elements.

Deflection and recovered strain away from a touch err by the fourth power of the element
(Richardson). Beside a touch that holds while elements are small against the distance: two thirds of
the elements are still so where half of them no longer are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe.arrays import F64
from fe.elements.mesh import Mesh, scaled_mesh

_FRACTION = 2.0 / 3.0  # of the elements in each run
_LEFT = 1.0 / (_FRACTION**-4 - 1.0)


class MeshError(NamedTuple):
    """Estimated errors at K points.

    Attributes
    ----------
    deflection : (K,) float64, mm
    strain : (K, 3) float64, strain
        Not a number where the strain is not one either.
    """

    deflection: F64
    strain: F64


def less_mesh(mesh: Mesh) -> Mesh:
    """Return the mesh of fewer elements that errors are estimated from."""
    return scaled_mesh(mesh, _FRACTION)


def left(values: F64, on_less: F64) -> F64:
    """Estimate the error of values from those on fewer elements, of the same shape."""
    return _LEFT * np.abs(values - on_less)

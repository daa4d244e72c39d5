"""How far a state is off because of its mesh, from the same state on half the elements.

Deflection and recovered strain away from a touch err by the fourth power of the element: what half
the elements change is fifteen times what is left (Richardson).
"""

from __future__ import annotations

from typing import NamedTuple

from fe.arrays import F64

RICHARDSON = 1.0 / 15.0
"""Error that is left, over the difference from the mesh of half the elements: 1 / (2⁴ - 1)."""


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

"""How much of what its material takes a plate is strained."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from fe.arrays import F64
from fe.elements.mesh import Mesh
from fe.plate.plate import Plate

if TYPE_CHECKING:
    from fe.linear.linear import Face

OVERSTRAINED = (
    "the material is strained beyond its limit: the plate yields or breaks, and these numbers "
    "are those of one that does neither"
)
"""Sentence for the user, of a state whose demand is above 1."""

# Places along each side at which strain is looked at, edges included.
_LOOKS = np.linspace(0.0, 1.0, 41)


class Strained(Protocol):
    """A state of a plate."""

    @property
    def plate(self) -> Plate:
        """The plate."""
        ...

    @property
    def mesh(self) -> Mesh:
        """Its grid."""
        ...

    def strain(self, xy: F64, face: Face = "top") -> F64:
        """Strain (K, 3) of a face; not a number beside a point force."""
        ...


def strain_demand(state: Strained) -> float:
    """Largest equivalent strain of both faces, in parts of the strain limit of the material.

    Equivalent is the stress of von Mises over Young's modulus, so that the limit is yield stress
    over Young's modulus. What lies beside a point force, where strain has no number, is left out.
    """
    x, y = (_LOOKS * side for side in state.plate.size)
    xy = np.column_stack([part.ravel() for part in np.meshgrid(x, y)])
    faces: tuple[Face, Face] = ("top", "bottom")
    largest = max(
        float(np.nanmax(equivalent(state.strain(xy, face), state.plate.poisson), initial=0.0))
        for face in faces
    )
    return largest / state.plate.strain_limit


def equivalent(strain: F64, poisson: float) -> F64:
    """Stress of von Mises over Young's modulus, from strain exx, eyy, exy (K, 3): (K,) float64."""
    xx, yy, xy = strain.T
    part = 1.0 / (1.0 - poisson**2)
    sx, sy, t = part * (xx + poisson * yy), part * (yy + poisson * xx), xy / (1.0 + poisson)
    return np.sqrt(np.maximum(sx**2 - sx * sy + sy**2 + 3.0 * t**2, 0.0))

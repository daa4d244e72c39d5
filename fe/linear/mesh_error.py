"""How far a state is off because of its mesh, from the same state on fewer elements.

Deflection and recovered strain away from a touch err by the fourth power of the element
(Richardson). Beside a touch that holds while elements are small against the distance: two thirds of
the elements are still so where half of them no longer are. Under a point force the deflection errs
by the square of the element, and by more or less as the force stands in it, which two meshes do not
show: there the error is no smaller than that of a force in any place of an element.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from fe.arrays import F64
from fe.elements.mesh import Mesh, scaled_mesh
from fe.elements.resolution import element_at
from fe.plate.plate import Plate, Touch

FRACTION = 2.0 / 3.0
"""Of the elements in each run, those of the mesh that errors are estimated from."""

if TYPE_CHECKING:
    from fe.linear.linear import Face

_LEFT = 1.0 / (FRACTION**-4 - 1.0)
_OVER = 1.0 / (1.0 - FRACTION**4)
# Deflection that a mesh lacks under a point force F, in parts of F h² / D: 0.002 where the force
# stands on a node and 0.004 where it does not, falling to nothing over two elements.
_YIELDING, _REACH = 0.0028, 2.0


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


class StateOnMesh(Protocol):
    """A state of a plate under touches, on a mesh."""

    @property
    def plate(self) -> Plate: ...  # noqa: D102

    @property
    def mesh(self) -> Mesh: ...  # noqa: D102

    @property
    def touches(self) -> tuple[Touch, ...]: ...  # noqa: D102

    def deflection(self, xy: ArrayLike) -> F64: ...  # noqa: D102

    def strain(self, xy: ArrayLike, face: Face) -> F64: ...  # noqa: D102


def error_of(state: StateOnMesh, less: StateOnMesh, xy: ArrayLike, face: Face) -> MeshError:
    """Estimate the error of a state at points (K, 2) mm from the same on fewer elements.

    Where the one resolves strain the other is read too, though it may not: give it no touches.
    """
    xy = state.plate.points(xy)
    near = under_touches(state.plate, state.mesh, state.touches, xy)
    return MeshError(
        np.maximum(left(state.deflection(xy), less.deflection(xy)), near),
        left(state.strain(xy, face), less.strain(xy, face)),
    )


def less_mesh(mesh: Mesh) -> Mesh:
    """Return the mesh of fewer elements that errors are estimated from."""
    return scaled_mesh(mesh, FRACTION)


def more_mesh(mesh: Mesh) -> Mesh:
    """Return the mesh of more elements, of which this one has two thirds."""
    return scaled_mesh(mesh, 1.0 / FRACTION)


def left(values: F64, on_less: F64) -> F64:
    """Estimate the error of values from those on fewer elements, of the same shape."""
    return _LEFT * np.abs(values - on_less)


def over(values: F64, on_more: F64) -> F64:
    """Estimate the error of values from those on more elements, of the same shape."""
    return _OVER * np.abs(values - on_more)


def under_touches(plate: Plate, mesh: Mesh, touches: Sequence[Touch], xy: F64) -> F64:
    """Estimate what a mesh lacks of the deflection near point forces, (K,) float64, mm.

    Parameters
    ----------
    plate : Plate
    mesh : Mesh
    touches : sequence of Touch
        Discs of an element or more are resolved and lack nothing.
    xy : (K, 2) float64, mm
    """
    lacks = np.zeros(len(xy))
    for touch in touches:
        place = np.array([[touch.x, touch.y]])
        element = element_at(mesh, place[0])
        if touch.radius < element:
            thickness, young = (float(part[0]) for part in plate.material(place))
            rigidity = young * thickness**3 / (12.0 * (1.0 - plate.poisson**2))
            away = np.hypot(*(xy - place).T) / (_REACH * element)
            size = _YIELDING * abs(touch.force) * element**2 / rigidity
            lacks += size * np.maximum(1.0 - away, 0.0)
    return lacks

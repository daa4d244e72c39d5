"""Where a mesh resolves the strain beside a touch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fe.arrays import F64, Mask
from fe.elements.mesh import Mesh
from fe.plate.plate import Plate, Touch

# The recovered strain beside a point force errs by 0.1 (element / distance)⁴ of the strain that
# plates of this size have: by 0.6 % two elements away, and by 10 % one.
_ELEMENTS = 2.0
# And within about its thickness a plate under a point force is no plate.
_THICKNESSES = 1.0


def unresolved(plate: Plate, mesh: Mesh, touches: Sequence[Touch], xy: F64) -> Mask:
    """Whether points lie so near to a touch that their strain is one of the mesh.

    The strain of a plate has no limit under a point force: there is no number to give. A disc of
    two elements or more is resolved, under it as well.

    Parameters
    ----------
    plate : Plate
    mesh : Mesh
    touches : sequence of Touch
    xy : (K, 2) float64, mm

    Returns
    -------
    (K,) bool
    """
    near = np.zeros(len(xy), dtype=bool)
    for touch in touches:
        place = np.array([[touch.x, touch.y]])
        reach = _ELEMENTS * element_at(mesh, place[0])
        if touch.radius < reach:
            reach = max(reach, _THICKNESSES * float(plate.material(place)[0][0]))
            near |= np.hypot(*(xy - place).T) <= reach
    return near


def element_at(mesh: Mesh, place: F64) -> float:
    """Longer side of the elements about a place, mm."""
    longest = 0.0
    for axis, nodes in enumerate(mesh.nodes):
        after = min(max(int(np.searchsorted(nodes, float(place[axis]))), 1), len(nodes) - 1)
        around = np.diff(nodes[max(after - 2, 0) : after + 2])
        longest = max(longest, float(around.max()))
    return longest

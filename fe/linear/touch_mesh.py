"""Meshes that are fine where touches press and where gauges lie."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fe.arrays import F64
from fe.elements.graded import Grading, graded
from fe.elements.mesh import Mesh, default_mesh
from fe.linear.load import check_touches
from fe.plate.plate import Plate, Touch

# Strains err by 4e-5 of the largest at a twentieth of the shorter side from a touch and by 1e-5
# beyond a tenth, on plates of 1:1 to 100:1 (study `plates.aspect`). At most 2.5 times the
# elements of a square plate: with many touches or gauges all elements are coarser.
_GRADING = Grading(finest=160.0, growth=0.15, elements=36000)
# Influences are read far from their gauges too, and there in parts of what is left of them. Gauges
# all along a strip take more elements the longer it is.
_FOR_GAUGES = _GRADING._replace(across=10.0, far=3.5)
_BY_ASPECT = 600


def touch_mesh(plate: Plate, touches: Sequence[Touch]) -> Mesh:
    """Return the mesh for touches that are known: one that is fine at these.

    Raises
    ------
    ValueError
        A touch, or a part of its disc, lies outside the plate.
    """
    check_touches(plate, touches)
    xy = np.array([(t.x, t.y) for t in touches]).reshape(-1, 2)
    return _fine_at(plate, xy, np.array([t.radius for t in touches]), _GRADING)


def gauge_mesh(plate: Plate, gauges: F64) -> Mesh:
    """Return the mesh for touches anywhere and gauges (M, 2) mm that are known."""
    elements = round(_BY_ASPECT * max(plate.size) / min(plate.size))
    grading = _FOR_GAUGES._replace(elements=max(elements, _FOR_GAUGES.elements))
    return _fine_at(plate, gauges, np.zeros(len(gauges)), grading)


def _fine_at(plate: Plate, xy: F64, radius: F64, grading: Grading) -> Mesh:
    """Return the mesh that is fine at discs, or the default one where that is as good.

    It is where there is no disc; and on a square whose discs are so many that grading takes more
    elements than the default mesh, which resolves every place of it.
    """
    default = default_mesh(plate)
    if not len(xy):
        return default
    fine = graded(plate, xy, radius, grading)
    square = plate.size[0] == plate.size[1]
    return default if square and np.prod(fine.counts) > np.prod(default.counts) else fine

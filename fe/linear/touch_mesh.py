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


def touch_mesh(plate: Plate, touches: Sequence[Touch]) -> Mesh:
    """Return the mesh for touches that are known: the default one of a square plate, else graded.

    On a square the default mesh resolves every place at a cost that grading cannot halve.

    Raises
    ------
    ValueError
        A touch, or a part of its disc, lies outside the plate.
    """
    check_touches(plate, touches)
    if plate.size[0] == plate.size[1] or not touches:
        return default_mesh(plate)
    xy = np.array([(t.x, t.y) for t in touches])
    return graded(plate, xy, np.array([t.radius for t in touches]), _GRADING)


def gauge_mesh(plate: Plate, gauges: F64) -> Mesh:
    """Return the mesh for touches anywhere and gauges (M, 2) mm that are known."""
    if plate.size[0] == plate.size[1] or not len(gauges):
        return default_mesh(plate)
    return graded(plate, gauges, np.zeros(len(gauges)), _GRADING)

"""Meshes that are fine where touches press and where gauges lie."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fe.arrays import F64
from fe.elements.graded import Grading, graded
from fe.elements.mesh import Mesh, default_mesh
from fe.linear.load import check_touches
from fe.plate.loads import LineLoad, Load, Pressure, steep_places
from fe.plate.plate import Plate, Touch

# Strains err by 4e-5 of the largest at a twentieth of the shorter side from a touch and by 1e-5
# beyond a tenth, on plates of 1:1 to 100:1 (study `plates.aspect`). At most 2.5 times the
# elements of a square plate: with many touches or gauges all elements are coarser.
_GRADING = Grading(finest=160.0, growth=0.15, elements=36000)
# Influences are read far from their gauges too, and there in parts of what is left of them. Gauges
# all along a strip take more elements the longer it is.
_FOR_GAUGES = _GRADING._replace(across=10.0, far=3.5)
_BY_ASPECT = 600
_STRIP = 64000  # at most: on longer strips elements at all gauges are coarser
# Pressure and lines bend the plate between its touches. On a square their strains err by 1e-4 of
# the largest, as those of 120 equal elements do by 3e-4.
_SPREAD = _GRADING._replace(across=12.0)


def touch_mesh(plate: Plate, touches: Sequence[Touch], loads: Sequence[Load] = ()) -> Mesh:
    """Return the mesh for touches and loads that are known: one that is fine at these.

    Under pressure and lines it is fine along the edges too, which these bend wherever they act.

    Raises
    ------
    ValueError
        A touch, or a part of its disc, lies outside the plate.
    """
    check_touches(plate, touches)
    xy, radius = loaded_places(plate, touches, loads)
    return _fine_at(plate, xy, radius, _SPREAD if spread_out(loads) else _GRADING)


def loaded_places(plate: Plate, touches: Sequence[Touch], loads: Sequence[Load]) -> tuple[F64, F64]:
    """Middles (P, 2) and radii (P,), mm, of discs about which a mesh is to be fine.

    Under pressure and lines two corners are among them: a grid that is fine there is so along all
    edges.
    """
    corners = [Touch(0.0, 0.0, 0.0), Touch(*plate.size, 0.0)] if spread_out(loads) else []
    discs = [*touches, *steep_places(loads, plate.size), *corners]
    xy = np.array([(disc.x, disc.y) for disc in discs]).reshape(-1, 2)
    return xy, np.array([disc.radius for disc in discs])


def gauge_mesh(plate: Plate, gauges: F64) -> Mesh:
    """Return the mesh for touches anywhere and gauges (M, 2) mm that are known."""
    along = min(round(_BY_ASPECT * max(plate.size) / min(plate.size)), _STRIP)
    grading = _FOR_GAUGES._replace(elements=max(along, _FOR_GAUGES.elements))
    return _fine_at(plate, gauges, np.zeros(len(gauges)), grading)


def spread_out(loads: Sequence[Load]) -> bool:
    """Whether a load acts on more than points."""
    return any(isinstance(load, Pressure | LineLoad) for load in loads)


def _fine_at(plate: Plate, xy: F64, radius: F64, grading: Grading) -> Mesh:
    """Return the mesh that is fine at discs, or the default one where that is as good.

    It is where there is no disc; and on a square whose discs are so many that grading takes more
    elements than the default mesh, which resolves every place of it.
    """
    if not len(xy):
        return default_mesh(plate)
    fine = graded(plate, xy, radius, grading)
    if plate.size[0] != plate.size[1]:
        return fine
    default = default_mesh(plate)
    return default if np.prod(fine.counts) > np.prod(default.counts) else fine

"""Meshes of the shell: fine where the plate bends sharply."""

from __future__ import annotations

from collections.abc import Sequence

from fe.elements.graded import Grading, graded
from fe.elements.mesh import Mesh, even_grid
from fe.linear.touch_mesh import loaded_places, spread_out
from fe.plate.loads import Load, Pressure
from fe.plate.plate import Plate, Touch

# Elements along the side of a square.
_SIDE = 40
# Fewer equal ones across are coarse at a clamp: 28 leave its strain off by 0.08 %, 16 by 0.7 %.
_FEW = 28
# Part of the shorter side that a rim along an edge takes there, and its elements.
_RIM = 0.15
_RIM_ELEMENTS = 8

# Where touches are known. Strains err by 8e-4 of the largest at a twentieth of the shorter side
# from a touch and beyond (study `plates.aspect`).
_GRADING = Grading(finest=72.0, growth=0.45, elements=18000)
# Pressure and lines bend the plate between its touches.
_SPREAD = _GRADING._replace(across=16.0)


def shell_mesh(plate: Plate) -> Mesh:
    """Return the default grid of the shell: `even_grid` of 40 elements a side.

    That of a long plate is coarse across, and has rims of smaller elements along its edges: 16
    equal ones across leave the strain of a clamp off by 0.7 % under an even pressure.

    Films bend sharply next to clamps and touches, within lengths of h / √(12 ε) at a stretch of ε.
    Where that is less than an element, the strain of the faces near a clamp and the deflection
    under a point are coarse: at a thickness of 1e-4 of the side off by 13 % and 3 %, while a disc
    and the strain of the middle keep to 1 % (study `plates.shell`, thickness).
    """
    even = even_grid(plate, _SIDE)
    if min(even.counts) >= _FEW or plate.patches:
        return even
    rim = _RIM * min(plate.size)
    inner = [
        max(2 * round(0.5 * count * (1.0 - 2.0 * rim / side)), _RIM_ELEMENTS)
        for count, side in zip(even.counts, plate.size, strict=True)
    ]
    counts = [count + 2 * _RIM_ELEMENTS for count in inner]
    a, b = plate.size
    runs = [(_RIM_ELEMENTS, count, _RIM_ELEMENTS) for count in inner]
    breaks = (rim, a - rim), (rim, b - rim)
    return Mesh(plate.size, (counts[0], counts[1]), breaks, (runs[0], runs[1]))


def pressed_mesh(plate: Plate, touches: Sequence[Touch], loads: Sequence[Load] = ()) -> Mesh:
    """Return the mesh for touches and loads that are known: one that is fine at these.

    Under pressure and lines it is fine along the edges too. Pressure alone, and nothing, is left to
    `shell_mesh`.
    """
    if not touches and all(isinstance(load, Pressure) for load in loads):
        return shell_mesh(plate)
    xy, radius = loaded_places(plate, touches, loads)
    return graded(plate, xy, radius, _SPREAD if spread_out(loads) else _GRADING)

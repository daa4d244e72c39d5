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
# Part of the shorter side that a rim along an edge takes; its elements are as long as 40 equal
# ones. At w/h 2 equal ones leave the strain of a clamp off by 0.09 % on 40 across, 0.14 % on
# 34, 0.22 % on 28 and 0.7 % on 16; nine in the rim by 0.09 %, twelve by 0.04 %. Two thirds of
# nine are the fewest that a run may have: on those the error of the mesh is found.
_RIM = 0.225
_RIM_ELEMENTS = 9
_INNER = 10  # at least
# Fewer equal ones across get a finer rim, and more elements in all.
_FEW = 28
_RIM_OF_FEW = 12

# Where touches are known. Strains err by 8e-4 of the largest at a twentieth of the shorter side
# from a touch and beyond (study `plates.aspect`).
_GRADING = Grading(finest=72.0, growth=0.45, elements=18000)
# Pressure and lines bend the plate between its touches.
_SPREAD = _GRADING._replace(across=16.0)


def shell_mesh(plate: Plate) -> Mesh:
    """Return the default grid of the shell: `even_grid` of 40 elements a side.

    That of a plate which is not square is coarse across, and has rims of smaller elements along its
    edges, where an even pressure bends a clamped plate sharply.

    Films bend sharply next to clamps and touches, within lengths of h / √(12 ε) at a stretch of ε.
    Where that is less than an element, the strain of the faces near a clamp and the deflection
    under a point are coarse: at a thickness of 1e-4 of the side off by 13 % and 3 %, while a disc
    and the strain of the middle keep to 1 % (study `plates.shell`, thickness).
    """
    even = even_grid(plate, _SIDE)
    across = min(even.counts)
    if across >= _SIDE or plate.patches:
        return even
    rim, elements = _RIM * min(plate.size), _RIM_ELEMENTS if across >= _FEW else _RIM_OF_FEW
    inner = (
        max(2 * round(0.5 * count * (1.0 - 2.0 * rim / side)), _INNER)
        for count, side in zip(even.counts, plate.size, strict=True)
    )
    x, y = ((elements, count, elements) for count in inner)
    a, b = plate.size
    return Mesh(plate.size, (sum(x), sum(y)), ((rim, a - rim), (rim, b - rim)), (x, y))


def pressed_mesh(plate: Plate, touches: Sequence[Touch], loads: Sequence[Load] = ()) -> Mesh:
    """Return the mesh for touches and loads that are known: one that is fine at these.

    Under pressure and lines it is fine along the edges too. Pressure alone, and nothing, is left to
    `shell_mesh`.
    """
    if not touches and all(isinstance(load, Pressure) for load in loads):
        return shell_mesh(plate)
    xy, radius = loaded_places(plate, touches, loads)
    return graded(plate, xy, radius, _SPREAD if spread_out(loads) else _GRADING)

"""How a reduced plate is made: states of the whole plate, then their basis and its forms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fe.elements.mesh import Mesh, even_grid, mesh_for
from fe.plate.aspect import check_aspect
from fe.plate.checks import positive
from fe.plate.plate import Plate, Touch
from fe.plate.thin import check_thin
from fe.reduced.basis import ReducedBasis, at_nodes, basis, fixed_shapes, work_on_strain
from fe.reduced.forms import form_steps, forms
from fe.reduced.karman import Karman
from fe.reduced.parallel import PARTS, Steps
from fe.reduced.reduced import Reduced
from fe.reduced.symmetry import symmetries
from fe.reduced.touch_shape import TouchShapes, touch_shapes
from fe.reduced.training import sample, snapshot_steps, snapshots, split

# Elements for the side of a square, and the part of the shorter one that the rim takes along each
# edge. Elements of the rim are smaller: where a clamped edge meets a free one strain is singular,
# and gauges 5 mm from the corner of a plate of 254 mm err by 1.8 % on even elements, here by 0.4 %.
_SIDE = 36
_RIM = 0.1
_RIM_ELEMENTS = 6
# Longer plates take gigabytes and a quarter of an hour.
_LONGEST = 250.0


def reduced_plate(
    plate: Plate,
    mesh: Mesh | None = None,
    force: float = 5.0,
    progress: Callable[[int, int], object] | None = None,
) -> Reduced:
    """Make a reduced plate from states of the whole one.

    Parameters
    ----------
    plate : Plate
    mesh : Mesh, optional
        If left out, as many elements as on a square of 36 a side, smaller ones along the edges.
    force : float
        Largest force of a touch, N; a finger presses with up to 5.
    progress : callable, optional
        Called with the steps done and their number.

    Returns
    -------
    Reduced

    Raises
    ------
    ValueError
        The mesh does not fit the plate, the force is not positive, or the plate is more than 250
        times as long as wide and no mesh is given.
    """
    force = positive(force, "largest force", "N")
    check_thin(plate)
    mesh = _mesh(plate) if mesh is None else mesh_for(plate, mesh)
    karman = Karman(plate, mesh)
    # A quarter of the states with four copies of each left an error of 13 %, a half of them 1 %.
    touches = sample(plate, force, max(len(symmetries(plate, mesh)) // 2, 1))
    steps = Steps(progress, 2 + _trained_steps(touches) + 2 * PARTS + form_steps(mesh))
    _ = karman.linear.factor
    steps.one()
    moving = touch_shapes(karman)
    steps.one()
    shapes, stresses, drifts, stretched = _trained(moving, touches, steps.one)
    nodal = at_nodes(karman, stresses)
    work = work_on_strain(karman, stresses, drifts, steps.one)
    del stresses  # as large as all that is kept
    fitted = forms(moving, shapes, work, nodal.shape[3], steps.one)
    fixed = np.zeros((*mesh.shape, fitted.fixed.shape[1]))
    fixed[:, :, : shapes.shape[2]] = shapes
    return Reduced(plate, mesh, fitted, fixed, nodal, drifts, stretched)


def _trained(
    shapes: TouchShapes, touches: list[tuple[Touch, ...]], progress: Callable[[], object]
) -> ReducedBasis:
    """Find the basis of states under touches and under their copies."""
    karman = shapes.karman
    states = snapshots(karman, touches, progress)
    ways = symmetries(karman.plate, karman.mesh)
    fixed = fixed_shapes(karman, split(shapes, states, progress), ways)
    progress()
    return basis(karman, states, fixed, ways, progress)


def _trained_steps(touches: list[tuple[Touch, ...]]) -> int:
    """Count the steps of `_trained`: states, their parts, fixed shapes, drifts, stresses."""
    return snapshot_steps(touches) + PARTS + 1 + 1 + PARTS


def _mesh(plate: Plate) -> Mesh:
    check_aspect(plate, _LONGEST)
    if plate.patches:
        return even_grid(plate, _SIDE)
    rim = _RIM * min(plate.size)
    element = plate.area**0.5 / _SIDE
    counts = [
        2 * _RIM_ELEMENTS + max(2 * round(0.5 * (side - 2 * rim) / element), 6)
        for side in plate.size
    ]
    a, b = plate.size
    return Mesh(plate.size, (counts[0], counts[1]), ((rim, a - rim), (rim, b - rim)))

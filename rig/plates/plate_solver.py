"""The plate of a scene under touches, by the theory that their forces need."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import fe
from rig.plates.cached import reduced
from rig.scene import Scene
from rig.scene.plate import PlateSection
from rig.scene.theory import choose, largest_force

Solver = fe.Linear | fe.Reduced


def plate_solver(
    scene: Scene, plate: PlateSection, elements: int, report: Callable[[int, int], None]
) -> Solver:
    """Prepare a plate: under small touches its stiffness, under large ones the reduced plate.

    Parameters
    ----------
    scene : Scene
    plate : PlateSection
        That of the scene.
    elements : int
        Along the longer side, under small touches.
    report : callable
        Called while the reduced plate is made, which takes half a minute once.
    """
    flat = plate.build()
    theory = choose(scene, plate, largest_force(scene))
    if theory.name == "linear":
        return fe.Linear(flat, fe.grid(flat, elements))
    return reduced(flat, theory.force, report)


def solve_plate(solver: Solver, touches: Sequence[fe.Touch]) -> fe.LinearState | fe.LargeState:
    """Press a plate."""
    return solver.deflect(touches) if isinstance(solver, fe.Linear) else solver.solve(touches)

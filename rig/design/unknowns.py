"""What it costs that a bench is not just as its scene says, and what presses would bring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import fe
import models
from models import CAUSES, ExpectedErrors
from rig.design.prediction import Prediction, equal_pattern, fields, image_motions, touches_over
from rig.system.arrays import F64

GROUPS = {"Young's modulus": ("young",), **CAUSES}
"""Numbers of a bench by what they are."""

PRESSES = 3  # along each side
FRAMES = 12  # of each
LABEL = np.array([0.2, 0.2, 0.003])
"""Standard deviations of the list of presses: of places, mm, and of forces, as fractions."""
FRICTION = 0.2
"""Of a finger: standard deviation of its force along the face over that into the plate."""
_ACROSS = 8  # touches along the longer side


@dataclass(frozen=True)
class Unknown:
    """A group of numbers of a bench, and by how much touches are off if nobody asks for them.

    Attributes
    ----------
    name : str
        One of `GROUPS`, or friction.
    place : float, mm
        Median over the plate, root mean square over benches as they usually are.
    force : float
        The same, as a fraction.
    """

    name: str
    place: float
    force: float


@dataclass(frozen=True, eq=False)
class Unknowns:
    """What is not known of a bench, in errors of touches.

    Attributes
    ----------
    force : float, N
        Of the touches, and of the presses.
    costs : tuple of Unknown
        The dearest first.
    before, after : ExpectedErrors
        Before any press, and after nine whose places and forces are known.
    calibrated : ExpectedErrors or None
        With what presses have shown of this bench; None where there were none.
    """

    force: float
    costs: tuple[Unknown, ...]
    before: ExpectedErrors
    after: ExpectedErrors
    calibrated: ExpectedErrors | None = None


def unknowns(
    now: Prediction,
    modal: fe.ModalPlate,
    force: float,
    before: models.BenchEstimate,
    calibrated: models.BenchEstimate | None = None,
) -> Unknowns:
    """Say what it costs under touches of `force` N that a bench is known only so well.

    Parameters
    ----------
    now : Prediction
    modal : fe.ModalPlate
        The plate of its setup in modes.
    force : float, N
    before : models.BenchEstimate
        What is known of the bench before any press.
    calibrated : models.BenchEstimate, optional
        What presses have shown of it; the camera is taken to stand as the scene says.
    """
    given = now.setup
    touches = touches_over(given.plate.size, force, _ACROSS)
    forward, friction = _on_bench(now, modal), models.friction_error(given.plate.build(), FRICTION)
    presses = _presses(given.plate.size, force)
    known = models.bench_after(forward, before, presses, LABEL, FRAMES**-0.5)
    costs = [
        _cost(name, models.cost_of(forward, before, of, touches)) for name, of in GROUPS.items()
    ]
    costs.append(Unknown(f"friction of {FRICTION:g}", friction, 0.0))
    return Unknowns(
        force,
        tuple(sorted(costs, key=lambda cost: -cost.place)),
        models.errors_on_bench(forward, before, touches),
        models.errors_on_bench(forward, known, touches),
        None if calibrated is None else models.errors_on_bench(forward, calibrated, touches),
    )


def _cost(name: str, off: ExpectedErrors) -> Unknown:
    fraction = off.force / off.touches[:, 2]
    return Unknown(name, float(np.median(off.place)), float(np.median(fraction)))


def _presses(size: tuple[float, float], force: float) -> F64:
    """List presses in the middles of equal cells, (9, 3) mm, mm, N."""
    sides = ((np.arange(PRESSES) + 0.5) / PRESSES * side for side in size)
    x, y = np.meshgrid(*sides)
    return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, force)])


def _on_bench(now: Prediction, modal: fe.ModalPlate) -> models.BenchForward:
    """Prepare the pattern through a camera whose place and lens may be other ones."""
    given = now.setup
    motions = image_motions(given.plate, given.camera, given.tile, modal)
    pattern = equal_pattern(given, motions, now.energy)
    flat, described = given.plate.build(), np.zeros(len(models.CAMERA))
    whole, view = fields(modal, flat), given.camera.build(given.plate)
    height = view.face_height(flat.thickness)
    look = models.CameraChange(pattern, whole.whole, view, height)
    through = whole.through(look.at(described, 0.0), described)
    return through.forward(pattern.factor / given.noise)

"""What a scene will reach, and which change of it helps most, before anything is bought.

Everything is the Cramér-Rao bound of single touches under the theory of the scene, with the motion
of the camera and the light unknown.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

import fe
import models
from models import ExpectedErrors
from rig.design.changes import Row, changes
from rig.design.focus import Blur, blur_of
from rig.design.limits import too_stiff
from rig.design.prediction import (
    UNIT,
    Prediction,
    from_strain,
    image_motions,
    linear_to,
    predict,
    time_of_frame,
)
from rig.design.search import Found, search
from rig.design.setup import Setup, setup_of
from rig.design.unknowns import Unknowns, unknowns
from rig.plates.cached import modal as modal_plate
from rig.scene import Scene
from rig.scene.described import described
from rig.scene.sensing import StrainEstimator
from rig.scene.theory import Theory, choose, largest_force

if TYPE_CHECKING:
    from rig.calibration.store import Calibration


Known = tuple[models.BenchEstimate, models.BenchEstimate | None]
"""A bench before any press, and as presses have shown it where there were some."""


@dataclass(frozen=True)
class DesignChange:
    """One thing that is changed, and what comes of it.

    Attributes
    ----------
    what, before, after : str
    place, force : float
        Median error over the plate under 1 N, mm and N.
    gain : float
        Factor by which the place gets better.
    linear_to : float, N
        As in `Design`.
    """

    what: str
    before: str
    after: str
    place: float
    force: float
    gain: float
    linear_to: float


@dataclass(frozen=True, eq=False)
class Design:
    """What a scene will reach.

    Attributes
    ----------
    title : str
    plate : fe.Plate
    errors : dict of str to Errors
        Errors under 1 N over the plate (see `over_plate`): the bound of the whole pattern against a
        perfect reference, and what the scene senses from.
    theory : Theory
        That all of it is computed with.
    at_forces : tuple of ExpectedErrors
        What the scene senses from, under the least and the largest force that it expects.
    unknowns : Unknowns or None
        What a bench costs that is not just as the scene says; None where the scene takes it so.
    linear_to : float, N
        Force up to which linear theory is right to 5 % anywhere on the plate.
    largest : float or None, N
        Largest force that the scene expects.
    frame : float, s
        Time of a frame with a touch that is followed, on this machine.
    rate : float, frames a second
        What camera and machine give together.
    changes : tuple of DesignChange
        The most helpful first.
    blur : Blur or None
        What is out of focus; None where the scene says nothing of the lens.
    too_stiff : str
        Why touches cannot be placed on such a plate, and what to change; empty where they can.
    """

    title: str
    plate: fe.Plate
    errors: dict[str, ExpectedErrors]
    theory: Theory
    at_forces: tuple[ExpectedErrors, ...]
    unknowns: Unknowns | None
    linear_to: float
    largest: float | None
    frame: float
    rate: float
    changes: tuple[DesignChange, ...]
    blur: Blur | None
    too_stiff: str


def design(
    scene: Scene, report: Callable[[int, int, str], None], calibration: Calibration | None = None
) -> Design:
    """Predict what a scene will reach; `report` is called before every step.

    Parameters
    ----------
    scene : Scene
    report : callable
        Is given the number of the step, the number of steps, and what it is.
    calibration : Calibration, optional
        Of this bench.

    Raises
    ------
    ValueError
        If the scene lacks something; see `setup_of`.
    """
    given = setup_of(scene)
    named, theory = list(changes(given)), choose(scene, given.plate, largest_force(scene))
    steps = len(named) + 3
    report(0, steps, "the plate in modes")
    known, modal = known_of(scene, given, calibration), in_modes(scene, theory, given)
    if known and modal is None:
        modal = modal_plate(given.plate.build(), lambda done, total: None)
    report(1, steps, "errors over the plate")
    now = predict(given, None, UNIT, bent(theory, modal))
    made = _changes(now, named, bent(theory, modal), lambda done, what: report(done, steps, what))
    report(steps - 1, steps, "time of a frame")
    motions = image_motions(given.plate, given.camera, given.dic.tile)
    errors = {"bound": now.at_noise(given.perfect_noise), "pattern": now.errors}
    if any(isinstance(one, StrainEstimator) for one in (scene.estimator, scene.comparison)):
        errors["strain"] = from_strain(now, motions)
    forces = scene.touches.force if scene.touches else ()
    frame = time_of_frame(given, motions)
    return Design(
        title=scene.title,
        plate=given.plate.build(),
        errors=errors,
        theory=theory,
        at_forces=tuple(predict(given, now, f, bent(theory, modal)).errors for f in forces),
        unknowns=_unknowns(scene, now, modal, known) if known and modal else None,
        linear_to=linear_to(given.plate.build()),
        largest=largest_force(scene),
        frame=frame,
        rate=min(given.camera.rate, 1 / frame),
        changes=made,
        blur=blur_of(given),
        # What bends so far that theory is another one is not too stiff.
        too_stiff=too_stiff(scene, now) if theory.name == "linear" else "",
    )


@dataclass(frozen=True, eq=False)
class Outlook:
    """What of a design a bench that stands is judged by; see `Design`."""

    errors: ExpectedErrors
    changes: tuple[DesignChange, ...]
    linear_to: float


def outlook(scene: Scene) -> Outlook:
    """Predict the errors of touches of 1 N, and what would make them smaller.

    Raises
    ------
    ValueError
        If the scene lacks something; see `setup_of`.
    """
    given = setup_of(scene)
    theory = choose(scene, given.plate, largest_force(scene))
    modal = None if theory.name == "linear" else in_modes(scene, theory, given)
    now = predict(given, None, UNIT, modal)
    made = _changes(now, list(changes(given)), modal, lambda done, what: None)
    return Outlook(now.errors, made, linear_to(given.plate.build()))


def search_for(scene: Scene, place: float, force: float | None) -> Found:
    """Find what reaches a median error of `place` mm under touches of `force` N.

    Without a force that is the least one that the scene expects.

    Raises
    ------
    ValueError
        If the scene lacks something, see `setup_of`; or place or force is not positive.
    """
    given = setup_of(scene)
    theory = choose(scene, given.plate, largest_force(scene))
    weakest = scene.touches.force[0] if scene.touches else UNIT
    wanted = weakest if force is None else force
    for value, what, unit in ((place, "error", "mm"), (wanted, "force", "N")):
        if value <= 0:
            raise ValueError(
                f"wanted {what} must be more than 0, got {value:g} {unit}; 1 {unit} is usual"
            )
    modal = in_modes(scene, theory, given)
    largest = max(largest_force(scene) or wanted, wanted)
    return search(given, place, wanted, largest, bent(theory, modal))


def in_modes(scene: Scene, theory: Theory, given: Setup) -> fe.ModalPlate | None:
    """Return the plate in modes, where touches are large or the bench is not known exactly."""
    if theory.name == "linear" and described(scene) == "exact":
        return None
    return modal_plate(given.plate.build(), lambda done, total: None)


def bent(theory: Theory, modal: fe.ModalPlate | None) -> fe.ModalPlate | None:
    """Return the plate that predictions need: none under linear theory."""
    return None if theory.name == "linear" else modal


def known_of(scene: Scene, given: Setup, calibration: Calibration | None) -> Known | None:
    """Return what is known of a bench before presses and by them; None where it counts as exact."""
    of_this = calibration.for_scene(scene) if calibration else None
    shown = of_this.known_bench() if of_this else None
    if shown is None and described(scene) == "exact":
        return None
    flat = given.plate.build()
    if of_this is None:
        return models.bench_before(flat), None
    return of_this.bench_before(flat, given.camera.pixels), shown


def _unknowns(scene: Scene, now: Prediction, modal: fe.ModalPlate, known: Known) -> Unknowns:
    weakest, strongest = scene.touches.force if scene.touches else (UNIT, UNIT)
    return unknowns(now, modal, (weakest * strongest) ** 0.5, *known)


def _changes(
    now: Prediction,
    named: list[Row],
    modal: fe.ModalPlate | None,
    report: Callable[[int, str], None],
) -> tuple[DesignChange, ...]:
    """Predict what each change brings, the most helpful first."""
    plate, made = now.setup.plate, list[DesignChange]()
    linear = linear_to(plate.build())
    for number, (what, before, after, other) in enumerate(named, start=2):
        report(number, what)
        then = predict(other, now, now.force, modal)
        limit = linear if other.plate == plate else linear_to(other.plate.build())
        made.append(_change((what, before, after), now.errors, then.errors, limit))
    return tuple(sorted(made, key=lambda change: -change.gain))


def _change(
    texts: tuple[str, str, str], now: ExpectedErrors, then: ExpectedErrors, linear: float
) -> DesignChange:
    place, force = float(np.median(then.place)), float(np.median(then.force))
    return DesignChange(*texts, place, force, float(np.median(now.place)) / place, linear)

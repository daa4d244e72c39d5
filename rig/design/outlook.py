"""What a scene will reach, and which change of it helps most, before anything is bought.

Everything is the Cramér-Rao bound of single touches under linear theory, with the camera's motion
and the light unknown.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import fe
from models import ExpectedErrors
from rig.design.prediction import from_strain, image_motions, linear_to, predict, time_of_frame
from rig.design.setup import changes, setup_of
from rig.scene import Scene
from rig.scene.sensing import StrainEstimator
from rig.scene.theory import largest_force


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
    linear_to : float, N
        Force up to which linear theory, and so all this, is right to 5 % anywhere on the plate.
    largest : float or None, N
        Largest force that the scene expects.
    frame : float, s
        Time of a frame with a touch that is followed, on this machine.
    rate : float, frames a second
        What camera and machine give together.
    changes : tuple of DesignChange
        The most helpful first.
    """

    title: str
    plate: fe.Plate
    errors: dict[str, ExpectedErrors]
    linear_to: float
    largest: float | None
    frame: float
    rate: float
    changes: tuple[DesignChange, ...]


def design(scene: Scene, report: Callable[[int, int, str], None]) -> Design:
    """Predict what a scene will reach; `report` is called before every step.

    Raises
    ------
    ValueError
        If the scene lacks something; see `setup_of`.
    """
    given = setup_of(scene)
    flat, named = given.plate.build(), list(changes(given))
    steps = len(named) + 2
    report(0, steps, "errors over the plate")
    now, linear = predict(given), linear_to(flat)
    made: list[DesignChange] = []
    for number, (what, before, after, changed) in enumerate(named, start=1):
        report(number, steps, what)
        then = predict(changed, like=now)
        limit = linear if changed.plate == given.plate else linear_to(changed.plate.build())
        made.append(_change((what, before, after), now.errors, then.errors, limit))
    report(steps - 1, steps, "time of a frame")
    motions = image_motions(given.plate, given.camera, given.dic.tile)
    errors = {"bound": now.at_noise(given.perfect_noise), "pattern": now.errors}
    if any(isinstance(one, StrainEstimator) for one in (scene.estimator, scene.comparison)):
        errors["strain"] = from_strain(now, motions)
    frame = time_of_frame(given, motions)
    return Design(
        title=scene.title,
        plate=flat,
        errors=errors,
        linear_to=linear,
        largest=largest_force(scene),
        frame=frame,
        rate=min(given.camera.rate, 1 / frame),
        changes=tuple(sorted(made, key=lambda change: -change.gain)),
    )


def _change(
    texts: tuple[str, str, str], now: ExpectedErrors, then: ExpectedErrors, linear: float
) -> DesignChange:
    place, force = float(np.median(then.place)), float(np.median(then.force))
    return DesignChange(*texts, place, force, float(np.median(now.place)) / place, linear)

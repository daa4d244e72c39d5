"""Whether a bench can work at all, before it is built: the sentence that refuses it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

import fe
from rig.design.prediction import predict
from rig.design.setup import setup_of
from rig.scene import Scene
from rig.scene.plate import PlateSection
from rig.scene.theory import choose, largest_force
from rig.setup.answers import Answers
from rig.setup.scene_file import scene_of

if TYPE_CHECKING:
    from fe import LinearRange

FARTHEST = 5.0  # mm, within which a touch of the largest force must be found in one frame
DEEPEST = 3.0  # deflection over thickness, up to which the theory of large touches was checked
FINEST = 0.2  # mm: a printer of 600 dpi draws no rounder spots than eight dots across
ROUNDS = 4  # of trials: the error falls a little slower than by the cube
THICKER = 1.1  # from one trial to the next
CUBE = 3.0  # power of the thickness with which a plate gets stiffer


def refusal(answers: Answers) -> str:
    """Say in a sentence why a bench cannot work and what to change; empty where it can.

    Errors are those of `touchplate design`, for the largest force.
    """
    try:
        scene = scene_of(answers)
        plate = setup_of(scene).plate
        return _too_soft(scene, plate) or _too_fine(scene) or _too_stiff(scene, plate)
    except ValueError as error:
        return str(error)


def _too_soft(scene: Scene, plate: PlateSection) -> str:
    regime = choose(scene, plate, largest_force(scene)).regime
    if regime is None or _bears(regime):
        return ""
    why = (
        f"strains the material to {regime.demand:.1f} times what it comes back from"
        if regime.demand > 1
        else f"bends it by {regime.ratio:.1f} times its thickness, and {DEEPEST:g} is the limit"
    )
    return (
        f"thickness is {plate.thickness:g} mm, and a touch of {regime.force:g} N {why}; set"
        f" thickness to {_rounded_up(_thick_enough(plate, regime.force))} mm or more, or expect"
        " less force"
    )


def _bears(regime: LinearRange) -> bool:
    """Whether a plate stays within its material and within the theory."""
    return regime.demand <= 1 and regime.ratio <= DEEPEST


def _thick_enough(plate: PlateSection, force: float) -> float:
    """Find a thickness that bears a force, mm, at which it is not yet too thick for the theory."""
    thickness = plate.thickness
    while True:
        thickness *= THICKER
        thicker = plate.model_copy(update={"thickness": thickness})
        if _bears(fe.linear_range(thicker.build(), force)):
            return thickness


def _too_fine(scene: Scene) -> str:
    pattern, camera = scene.pattern, scene.camera
    if pattern is None or camera is None or pattern.diameter >= FINEST:
        return ""
    width, height = (int(0.95 * side * pattern.diameter / FINEST) for side in camera.pixels)
    return (
        f"camera pixels are {camera.pixels[0]} x {camera.pixels[1]}, for which speckles must be"
        f" {pattern.diameter:g} mm wide, and no printer draws them below {FINEST:g} mm; set pixels"
        f" to {width} x {height} or fewer"
    )


def _too_stiff(scene: Scene, plate: PlateSection) -> str:
    setup, force = setup_of(scene), largest_force(scene) or 1.0
    found = predict(setup)
    place = float(np.median(found.errors.place)) / force
    if place <= FARTHEST:
        return ""
    thinner, left = plate.thickness, place
    for _ in range(ROUNDS):
        if left <= FARTHEST:
            break
        thinner *= min(FARTHEST / left, 1 / THICKER) ** (1 / CUBE)
        other = replace(setup, plate=plate.model_copy(update={"thickness": thinner}))
        left = float(np.median(predict(other, like=found).errors.place)) / force
    return (
        f"thickness is {plate.thickness:g} mm, and a touch of {force:g} N would be found to"
        f" {place:.0f} mm only; set thickness to {_rounded_down(thinner)} mm or less, or expect"
        " more force"
    )


def _rounded_up(value: float) -> str:
    return f"{np.ceil(10 * value) / 10:g}"


def _rounded_down(value: float) -> str:
    return f"{np.floor(10 * value) / 10:g}" if value > 0.2 else f"{value:.2g}"

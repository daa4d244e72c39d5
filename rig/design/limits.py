"""Whether a bench can work at all, before it is built: the sentence that refuses it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

import fe
from rig.design.focus import Blur, blur_of, sharpest
from rig.design.prediction import Prediction, predict
from rig.design.setup import Setup, focused, setup_of
from rig.scene import Scene
from rig.scene.bench import LensSection
from rig.scene.plate import PlateSection
from rig.scene.theory import choose, largest_force

if TYPE_CHECKING:
    from fe import LinearRange

FARTHEST = 5.0  # mm, within which a touch of the largest force must be found in one frame
DEEPEST = 3.0  # deflection over thickness, up to which the theory of large touches was checked
FINEST = 0.2  # mm: a printer of 600 dpi draws no rounder spots than eight dots across
ROUNDS = 4  # of trials: the error falls a little slower than by the cube
THICKER = 1.1  # from one trial to the next
CUBE = 3.0  # power of the thickness with which a plate gets stiffer
BLURRED = 1.0  # speckles across a circle out of focus: errors are twice those of a sharp image
NYQUIST = 2.0  # px: a finer speckle is not seen as it is printed


def refusal(scene: Scene) -> str:
    """Say in a sentence why a bench cannot work and what to change; empty where it can.

    Errors are those of linear theory, for the largest force.

    Raises
    ------
    ValueError
        If the scene lacks a part; see `setup_of`.
    """
    return cannot_work(scene) or too_stiff(scene, predict(setup_of(scene)))


def cannot_work(scene: Scene) -> str:
    """Say the same of what needs no prediction: a plate too soft, speckles too fine or blurred."""
    given = setup_of(scene)
    return _too_soft(scene, given.plate) or _too_fine(given) or _aliased(given) or _blurred(given)


def speckle_in_pixels(given: Setup) -> float:
    """Diameter of a speckle in the middle of the image, px."""
    view, (a, b) = given.camera.build(given.plate), given.plate.size
    height, half = view.face_height(given.plate.thickness), given.pattern.diameter / 2
    ends = np.array([[a / 2 - half, b / 2, height], [a / 2 + half, b / 2, height]])
    return float(np.linalg.norm(np.diff(view.project(ends), axis=0)))


def bears(regime: LinearRange) -> bool:
    """Whether a plate stays within its material and within the theory."""
    return regime.demand <= 1 and regime.ratio <= DEEPEST


def _aliased(given: Setup) -> str:
    speckle = speckle_in_pixels(given)
    if speckle >= NYQUIST:
        return ""
    wider = given.pattern.diameter * NYQUIST / speckle
    return (
        f"speckles of {given.pattern.diameter:g} mm are {speckle:.2g} px wide in the image, and"
        f" below {NYQUIST:g} px a camera sees another pattern than is printed; set"
        f" pattern.diameter to {_rounded_up(wider)} mm or more"
    )


def _blurred(given: Setup) -> str:
    blur, lens = blur_of(given), given.camera.lens
    if blur is None or lens is None:
        return ""
    widest, limit = max(blur.circles), BLURRED * speckle_in_pixels(given)
    if widest <= limit:
        return ""
    return (
        f"{_focus_of(lens, blur)}, so that a point of it is {widest:.2g} px wide and a speckle"
        f" {limit / BLURRED:.2g};"
        f" set camera.lens.focus to {sharpest(given):.4g} mm, or camera.lens.f_number"
        f" to {_rounded_up(lens.f_number * widest / limit)} or more"
    )


def _focus_of(lens: LensSection, blur: Blur) -> str:
    near, far = (f"{depth:.4g}" for depth in blur.depths)
    away = near if near == far else f"{near} to {far}"
    return f"camera.lens.focus is {lens.focus:g} mm and the plate is {away} mm from the lens"


def _too_soft(scene: Scene, plate: PlateSection) -> str:
    regime = choose(scene, plate, largest_force(scene)).regime
    if regime is None or bears(regime):
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


def _thick_enough(plate: PlateSection, force: float) -> float:
    """Find a thickness that bears a force, mm, at which it is not yet too thick for the theory."""
    thickness = plate.thickness
    while True:
        thickness *= THICKER
        thicker = plate.model_copy(update={"thickness": thickness})
        if bears(fe.linear_range(thicker.build(), force)):
            return thickness


def _too_fine(given: Setup) -> str:
    pattern, camera = given.pattern, given.camera
    if pattern.diameter >= FINEST:
        return ""
    width, height = (int(0.95 * side * pattern.diameter / FINEST) for side in camera.pixels)
    return (
        f"camera pixels are {camera.pixels[0]} x {camera.pixels[1]} and speckles"
        f" {pattern.diameter:g} mm wide, and no printer draws them below {FINEST:g} mm; set pixels"
        f" to {width} x {height} or fewer in `touchplate setup`, where speckles follow from them;"
        f" in a scene set pattern.diameter to {FINEST:g} mm or more"
    )


def too_stiff(scene: Scene, found: Prediction) -> str:
    """Say why touches cannot be placed, from what linear theory predicts; empty where they can."""
    given, force = found.setup, largest_force(scene) or 1.0
    plate = given.plate
    place = float(np.median(found.errors.place)) / force
    if place <= FARTHEST:
        return ""
    if why := _found_if_focused(found, force, place):
        return why
    thinner, left = plate.thickness, place
    for _ in range(ROUNDS):
        if left <= FARTHEST:
            break
        thinner *= min(FARTHEST / left, 1 / THICKER) ** (1 / CUBE)
        other = replace(given, plate=plate.model_copy(update={"thickness": thinner}))
        left = float(np.median(predict(other, like=found).errors.place)) / force
    return (
        f"thickness is {plate.thickness:g} mm, and a touch of {force:g} N would be found to"
        f" {place:.0f} mm only; set thickness to {_rounded_down(thinner)} mm or less, or expect"
        " more force"
    )


def _found_if_focused(found: Prediction, force: float, place: float) -> str:
    """Say that focus alone keeps touches from being placed; empty where it does not."""
    given, sharp = found.setup, sharpest(found.setup)
    blur, lens = blur_of(given), given.camera.lens
    if blur is None or lens is None:
        return ""
    focus = predict(focused(given, sharp), like=found)
    if float(np.median(focus.errors.place)) / force > FARTHEST:
        return ""
    return (
        f"{_focus_of(lens, blur)}, so that a touch of {force:g} N would be found to {place:.0f} mm"
        f" only; set camera.lens.focus to {sharp:.4g} mm"
    )


def _rounded_up(value: float) -> str:
    return f"{np.ceil(10 * value) / 10:g}"


def _rounded_down(value: float) -> str:
    return f"{np.floor(10 * value) / 10:g}" if value > 0.2 else f"{value:.2g}"

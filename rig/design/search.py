"""The cheapest change of a bench that reaches a wanted error."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import log

import numpy as np

import fe
from rig.design.focus import sharpest
from rig.design.limits import FINEST, bears, speckle_in_pixels
from rig.design.prediction import Prediction, predict
from rig.design.setup import Setup, as_thick, at_distance, changed, focused
from rig.scene.bench import CameraSection

SEEN = 2.5  # px: speckles below are seen with less contrast, and their motion with a bias
NEAREST = 1.0  # stand-off in longer sides: a lens that sees a plate from nearer bends it
THINNEST = 0.2  # of the thickness
MAX_PIXELS = 5120  # along the longer side of an image
MAX_FRAMES = 8  # averaged: a third of a second at 30 images a second
_ROUNDS = 6  # of a search: the error falls nearly as a power of what is changed
_CLOSE = 0.02  # of the wanted error, from which a search need not go on


@dataclass(frozen=True)
class Way:
    """One thing that may be changed, as far as that goes.

    Attributes
    ----------
    what, unit : str
    before : float
    limit : float
        How far it may be changed.
    change : callable
        From its value to the setup.
    """

    what: str
    unit: str
    before: float
    limit: float
    change: Callable[[float], Setup]


@dataclass(frozen=True)
class Step:
    """A change that was found.

    Attributes
    ----------
    what, unit : str
    before, after : float
    place : float, mm
        Median error over the plate after it, and after all steps before it.
    """

    what: str
    unit: str
    before: float
    after: float
    place: float


@dataclass(frozen=True)
class Found:
    """What reaches a wanted error.

    Attributes
    ----------
    place, force : float
        Wanted median error, mm, under touches of that force, N.
    now : float, mm
        As the scene is.
    alone : tuple of Step
        Each changed alone, those that reach it, the cheapest first.
    together : tuple of Step
        Where none does: one after the other, each as far as it goes, the last only as far as it
        must; it is not reached where the last is worse than wanted.
    """

    place: float
    force: float
    now: float
    alone: tuple[Step, ...]
    together: tuple[Step, ...]

    @property
    def reached(self) -> bool:
        """Whether anything reaches it."""
        return self.now <= self.place or any(
            step.place <= self.place for step in (*self.alone, *self.together)
        )


def search(
    given: Setup, place: float, force: float, largest: float, modal: fe.ModalPlate | None
) -> Found:
    """Find what reaches a wanted error of the place.

    Parameters
    ----------
    given : Setup
    place : float, mm
        Wanted median over the plate, in one estimate.
    force : float, N
        Of the touches.
    largest : float, N
        Largest force, which the plate must bear.
    modal : fe.ModalPlate or None
        See `predict`.
    """
    now = predict(given, None, force, modal)
    if _median(now) <= place:
        return Found(place, force, _median(now), (), ())
    found = [_changed_enough(way(given, largest), now, place, modal) for way in WAYS]
    alone = tuple(step for step in found if step.place <= place)
    together = () if alone else tuple(_one_after_the_other(now, place, largest, modal))
    return Found(place, force, _median(now), alone, together)


def focus(given: Setup, largest: float) -> Way:
    """Focus at the plate."""
    del largest
    lens, sharp = given.camera.lens, sharpest(given)
    before = sharp if lens is None else lens.focus
    return Way("focus distance", "mm", before, sharp, lambda distance: focused(given, distance))


def speckles(given: Setup, largest: float) -> Way:
    """Finer speckles, as fine as they are still seen and printed."""
    del largest
    pattern = given.pattern
    finest = max(FINEST, pattern.diameter * SEEN / speckle_in_pixels(given))

    def drawn(diameter: float) -> Setup:
        return replace(given, pattern=changed(pattern, diameter=diameter))

    return Way("speckle diameter", "mm", pattern.diameter, min(finest, pattern.diameter), drawn)


def frames(given: Setup, largest: float) -> Way:
    """More frames in a mean."""
    del largest
    limit = max(MAX_FRAMES, given.frames)
    return Way("mean of frames", "", given.frames, limit, lambda n: replace(given, frames=round(n)))


def thickness(given: Setup, largest: float) -> Way:
    """Make the plate thinner, as thin as it bears the largest force."""
    plate = given.plate
    thinnest = min(_thinnest(given, largest), plate.thickness)

    def cut(thick: float) -> Setup:
        return replace(given, plate=as_thick(plate, thick))

    return Way("thickness", "mm", plate.thickness, thinnest, cut)


def stand_off(given: Setup, largest: float) -> Way:
    """Bring the camera nearer, with a lens that still sees all of the plate."""
    del largest
    camera = given.camera
    nearest = min(NEAREST * max(given.plate.size), camera.stand_off)

    def moved(distance: float) -> Setup:
        return replace(given, camera=at_distance(camera, distance))

    what = "stand-off, with a lens that sees all of the plate"
    return Way(what, "mm", camera.stand_off, nearest, moved)


def pixels(given: Setup, largest: float) -> Way:
    """Take a camera of more pixels."""
    del largest
    width = given.camera.pixels[0]

    def bought(value: float) -> Setup:
        return replace(given, camera=_as_wide(given, value))

    return Way("width of the image", "px", width, max(MAX_PIXELS, width), bought)


WAYS = focus, speckles, frames, thickness, stand_off, pixels
"""What may be changed, the cheapest first: turn a ring, print, wait, cut, move, buy."""


def _changed_enough(way: Way, now: Prediction, place: float, modal: fe.ModalPlate | None) -> Step:
    """Change one thing as little as reaches a wanted error, or as far as it helps.

    The error is near to a power of what is changed, so that a secant of logarithms finds it. A way
    that does not reach it is gone to its end, or not at all: speckles too fine are aliased.
    """
    known = [(log(way.before), _median(now))]
    if abs(log(way.limit / way.before)) < _CLOSE:
        return Step(way.what, way.unit, way.before, way.before, known[0][1])
    value = way.limit
    for _ in range(_ROUNDS):
        known.append((log(value), _median(predict(way.change(value), now, now.force, modal))))
        if value == way.limit and known[-1][1] > place:
            break
        if 0 <= 1 - known[-1][1] / place <= _CLOSE:
            break
        value = _between(known, place, way)
    reached = [point for point in known[1:] if point[1] <= place]
    reached = reached or [min(known, key=lambda point: point[1])]
    at, error = min(reached, key=lambda point: abs(point[0] - known[0][0]))
    after = way.before if at == known[0][0] else float(np.exp(at))
    return Step(way.what, way.unit, way.before, after, error)


def _between(known: list[tuple[float, float]], place: float, way: Way) -> float:
    """Guess where the wanted error lies, half the tolerance on the good side of it."""
    wanted = log(place * (1 - _CLOSE / 2))
    far = min((p for p in known if p[1] <= place), key=lambda p: abs(p[0] - known[0][0]))
    near = max((p for p in known if p[1] > place), key=lambda p: abs(p[0] - known[0][0]))
    part = (log(near[1]) - wanted) / (log(near[1]) - log(far[1]))
    guess = float(np.exp(near[0] + part * (far[0] - near[0])))
    return guess if way.unit else float(np.ceil(guess))  # frames are whole


def _one_after_the_other(
    now: Prediction, place: float, largest: float, modal: fe.ModalPlate | None
) -> Iterator[Step]:
    given = now.setup
    for make in WAYS:
        way = make(given, largest)
        step = _changed_enough(way, now, place, modal)
        if step.after == step.before:
            continue
        yield step
        if step.place <= place:
            return
        given = way.change(step.after)
        now = predict(given, now, now.force, modal)


def _thinnest(given: Setup, largest: float) -> float:
    """Find how thin the plate may be to bear the largest force, mm."""
    thick, thin = given.plate.thickness, THINNEST * given.plate.thickness
    for _ in range(8):
        tried = (thick * thin) ** 0.5
        if bears(fe.linear_range(as_thick(given.plate, tried).build(), largest)):
            thick = tried
        else:
            thin = tried
    return thick


def _as_wide(given: Setup, value: float) -> CameraSection:
    width, height = given.camera.pixels
    return changed(given.camera, pixels=(round(value), round(value * height / width)))


def _median(prediction: Prediction) -> float:
    return float(np.median(prediction.errors.place))

"""Touches by a script: what presses the twin's plate, as a pure function of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import fe
from rig.calibration.requested_presses import requested_presses

Script = Callable[[float], tuple[fe.Touch, ...]]
"""Touches at a time in s since the first frame."""

STILL = 1.0  # s at the start of every script in which nothing touches and nothing moves
RAMP = 0.3  # s that a finger takes to press and to leave
PLACES = 6  # of the script 'presses', which begins again after them
HELD, LIFTED = 3.0, 1.0  # s of each, and from one to the next
TAPPED, APART = 0.02, 1.0  # s that a tap of a knuckle lasts, and from one to the next
INSET = 25.0  # mm from an edge, or a quarter of the side, within which no random touch lies
TURN, PAUSE = 1.6, 0.3  # s from one known press to the next, and without a touch between


def at_rest(time: float) -> bool:
    """Whether the plate is untouched and the camera unmoved, so that the reference can be taken."""
    return time < STILL


@dataclass(frozen=True)
class ScriptedPress:
    """One finger: appears, moves along a path while it presses, and leaves.

    Attributes
    ----------
    start, duration : float, s
    path : ((x, y), …), fractions of the plate's sides
        Passed at constant pace; one place for a finger that rests.
    force : (float, float), N
        Force after the ramp, and before it leaves; it changes steadily between.
    """

    start: float
    duration: float
    path: tuple[tuple[float, float], ...]
    force: tuple[float, float]

    def at(self, time: float, size: tuple[float, float]) -> fe.Touch | None:
        """Touch at a time, None before and after."""
        age = time - self.start
        if not 0 < age < self.duration:
            return None
        fraction = age / self.duration
        along = fraction * (len(self.path) - 1)
        x, y = (
            np.interp(along, np.arange(len(self.path)), [place[axis] for place in self.path])
            for axis in (0, 1)
        )
        rise = min(1.0, age / RAMP, (self.duration - age) / RAMP)
        force = rise * (self.force[0] + fraction * (self.force[1] - self.force[0]))
        return fe.Touch(float(x * size[0]), float(y * size[1]), float(force))


TOUR = (
    ScriptedPress(1.5, 3.0, ((0.50, 0.50),), (2.0, 2.0)),
    ScriptedPress(5.0, 5.0, ((0.20, 0.25), (0.80, 0.30), (0.75, 0.80), (0.25, 0.70)), (1.0, 3.0)),
    ScriptedPress(10.5, 3.0, ((0.30, 0.65),), (0.5, 4.0)),
    ScriptedPress(14.0, 6.0, ((0.25, 0.30), (0.30, 0.75)), (2.5, 1.5)),
    ScriptedPress(15.0, 4.0, ((0.75, 0.70), (0.70, 0.30)), (1.5, 3.0)),
    ScriptedPress(21.0, 3.0, ((0.85, 0.15),), (4.0, 4.0)),
)
TOUR_LENGTH = 25.0  # s; then it starts again


def tour(size: tuple[float, float]) -> Script:
    """Presses, a move, a ramp, two fingers at once and a corner, over and over."""

    def touches(time: float) -> tuple[fe.Touch, ...]:
        at = (press.at(time % TOUR_LENGTH, size) for press in TOUR)
        return tuple(touch for touch in at if touch is not None)

    return touches


def random_touches(
    size: tuple[float, float], force: tuple[float, float], seed: int, rate: float
) -> Script:
    """Draw one touch for each of `rate` frames a second, `INSET` or more from the edges.

    Parameters
    ----------
    size : (float, float), mm
    force : (float, float), N
        Smallest and largest.
    seed : int
    rate : float, frames a second
    """

    def touches(time: float) -> tuple[fe.Touch, ...]:
        if at_rest(time):
            return ()
        draw = np.random.default_rng((seed, round(time * rate)))
        insets = (min(INSET, side / 4) for side in size)
        x, y = (draw.uniform(inset, side - inset) for inset, side in zip(insets, size, strict=True))
        return (fe.Touch(x, y, draw.uniform(*force)),)

    return touches


def presses(
    size: tuple[float, float], force: tuple[float, float], seed: int
) -> tuple[ScriptedPress, ...]:
    """Draw presses that rest, one after the other; see `pressing`.

    Parameters
    ----------
    size : (float, float), mm
    force : (float, float), N
        Smallest and largest.
    seed : int
    """
    draw, found = np.random.default_rng(seed), list[ScriptedPress]()
    for number in range(PLACES):
        insets = (min(INSET, side / 4) / side for side in size)
        x, y = (float(draw.uniform(inset, 1 - inset)) for inset in insets)
        pressed = float(draw.uniform(*force))
        start = STILL + LIFTED + number * (HELD + LIFTED)
        found.append(ScriptedPress(start, HELD, ((x, y),), (pressed, pressed)))
    return tuple(found)


def pressing(size: tuple[float, float], presses: tuple[ScriptedPress, ...]) -> Script:
    """Press one place after the other, over and over."""
    length = len(presses) * (HELD + LIFTED)

    def touches(time: float) -> tuple[fe.Touch, ...]:
        within = time if time < STILL or not presses else STILL + (time - STILL) % length
        at = (press.at(within, size) for press in presses)
        return tuple(touch for touch in at if touch is not None)

    return touches


def taps(size: tuple[float, float], force: tuple[float, float], seed: int) -> Script:
    """Tap the plate once a second, as hard as half a sine, at places drawn as for `presses`."""
    places = [(press.path[0], press.force[0]) for press in presses(size, force, seed)]

    def touches(time: float) -> tuple[fe.Touch, ...]:
        turn, age = divmod(time - STILL, APART)
        if at_rest(time) or not 0.0 < age < TAPPED:
            return ()
        (x, y), hard = places[int(turn) % len(places)]
        now = hard * float(np.sin(np.pi * age / TAPPED))
        return (fe.Touch(x * size[0], y * size[1], now),)

    return touches


def collect(size: tuple[float, float], force: tuple[float, float], seed: int) -> Script:
    """Press what a collection asks for, one after the other, over and over."""
    presses = requested_presses(size, force, seed)

    def touches(time: float) -> tuple[fe.Touch, ...]:
        if at_rest(time):
            return ()
        turn, age = divmod(time - STILL, TURN)
        touch = presses[int(turn) % len(presses)]
        rise = min(1.0, age / RAMP, (TURN - PAUSE - age) / RAMP)
        return (replace(touch, force=rise * touch.force),) if rise > 0 else ()

    return touches


def empty(time: float) -> tuple[fe.Touch, ...]:
    """Nobody touches the plate."""
    return ()

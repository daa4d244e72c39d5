"""Ripples: a touch makes waves on the plate, as a stone does on water."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np

from rig.projector.demos.canvas import SMOOTH, Canvas, blank, laid
from rig.projector.demos.moment import Moment
from rig.projector.markers import Screen
from rig.system.arrays import F32, F64, Grey

PACE, WAVE, WIDE = 90.0, 16.0, 14.0  # mm/s of the rings, their wavelength, the length of a train
FADES, LAST = 0.9, 3.0  # s in which a train falls to 1/e, and after which it is over
AGAIN = 0.6  # s between the trains of a finger that stays,
WEAKER = 0.55  # and how strong they are beside the first
STRONG = 2.0  # N of a touch whose waves are as high as shown
MANY = 24  # trains at one time; the oldest are over first
STEP = 0.25  # mm between the entries of a table of heights
RAMP = np.array(
    [[0.0, 0.0, 0.0], [0.02, 0.16, 0.38], [0.15, 0.52, 0.80], [0.62, 0.88, 0.97], [1.0, 1.0, 1.0]]
)
"""Black over blue to white: brightness alone tells the height, whatever colours one sees."""


class Train(NamedTuple):
    """Waves that began at a place, mm, and a time, s, with a height of 0 to 1."""

    x: float
    y: float
    begun: float
    height: float


@dataclass(frozen=True)
class Ripples:
    """All waves on the plate.

    Attributes
    ----------
    plate_size : (a, b), mm
    time : float, s
    trains : tuple of Train
    fed : tuple of (int, float)
        Finger, and when its last train began, s.
    """

    plate_size: tuple[float, float]
    time: float = 0.0
    trains: tuple[Train, ...] = ()
    fed: tuple[tuple[int, float], ...] = ()

    def after(self, moment: Moment) -> Ripples:
        """Go on to the next frame: a landing makes waves, and so does a finger that stays."""
        last, now = dict(self.fed), moment.time
        begun: list[Train] = []
        fed: dict[int, float] = {}
        for mark in moment.touches:
            name = mark.identity or 0
            landed = name not in last
            fed[name] = last.get(name, now)
            if landed or now - last[name] >= AGAIN:
                height = min(np.sqrt(max(mark.force, 0.0) / STRONG), 1.0)
                begun.append(Train(mark.x, mark.y, now, height if landed else WEAKER * height))
                fed[name] = now
        alive = [train for train in self.trains if now - train.begun < LAST]
        trains = tuple([*alive, *begun][-MANY:])
        return replace(self, time=now, trains=trains, fed=tuple(fed.items()))

    def tared(self) -> Ripples:
        """Leave the plate still."""
        return Ripples(self.plate_size, self.time)

    def drawn(self, screen: Screen) -> Grey:
        """Draw crests as light; troughs stay dark."""
        on = blank(self.plate_size, SMOOTH)
        if not self.trains:
            return laid(on, screen, 0.0)
        crests = np.clip(self.heights(on), 0.0, 1.0)
        on.image[:] = _colours()[np.rint(255 * crests).astype(np.uint8)]
        return laid(on, screen, 0.0)

    def heights(self, on: Canvas) -> F32:
        """Height of the water at each px of a canvas, (H, W) float32, of 1 for a fresh wave."""
        x, y = on.places()
        total = np.zeros((len(y), len(x)), np.float32)
        far = np.hypot(*self.plate_size)
        reach = np.arange(0.0, far + 2 * STEP, STEP)
        for train in self.trains:
            age = self.time - train.begun
            heights = (train.height * profile(reach, age)).astype(np.float32)
            away = np.hypot(x - train.x, (y - train.y)[:, None])
            total += heights[(away / STEP).astype(np.int32).clip(0, len(heights) - 1)]
        return total


@cache
def _colours() -> Grey:
    """Colour of each of 256 heights, (256, 3)."""
    table = np.empty((256, 3))
    for channel in range(3):
        table[:, channel] = np.interp(
            np.arange(256) / 255, np.linspace(0, 1, len(RAMP)), RAMP[:, channel]
        )
    return np.rint(255 * table).astype(np.uint8)


def profile(reach: F64, age: float) -> F64:
    """Height of a train of waves at distances, mm, from where it began `age` s ago."""
    behind = reach - PACE * age
    return np.cos(2 * np.pi * behind / WAVE) * np.exp(-((behind / WIDE) ** 2) - age / FADES)

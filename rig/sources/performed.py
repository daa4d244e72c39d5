"""What is done on the twin's plate for a demo: weights that are laid down, a melody on keys."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np

import fe
from rig.projector.demos.keyboard import Key, lay_keys
from rig.sources.script import Script

BEGINS = 1.5  # s
ROUND = 16.0  # s, after which the weights are laid anew
LAID, TAKEN = 0.25, 0.3  # s in which a weight comes to rest, and in which it is lifted
TUNE = (0, 2, 4, 5, 7, 7, 9, 9, 7, 5, 5, 4, 4, 2, 2, 0)  # semitones above the first key
BEATS = (1, 1, 1, 1, 2, 2, 1, 1, 3, 1, 1, 1, 1, 1, 1, 3)
BEAT, REST = 0.45, 2.0  # s of a beat, and of the pause before the tune begins again
HELD = 0.7  # of its beats that a key is held
ATTACK = (0.03, 0.12)  # s in which a finger presses, of a loud note and of a soft one


@dataclass(frozen=True)
class Weight:
    """A weight at a place, in fractions of the sides, for a time in s; its force as a fraction."""

    place: tuple[float, float]
    begun: float
    ended: float
    force: float


WEIGHTS = (
    Weight((0.45, 0.42), 0.0, 12.0, 0.5),
    Weight((0.68, 0.38), 4.0, 8.0, 0.25),
    Weight((0.30, 0.36), 10.0, 14.0, 0.12),
)


def weights(size: tuple[float, float], force: tuple[float, float]) -> Script:
    """Lay weights on the plate and lift them, over and over; at most two lie at a time.

    Parameters
    ----------
    size : (float, float), mm
    force : (float, float), N
        Smallest and largest of a touch.
    """

    def touches(time: float) -> tuple[fe.Touch, ...]:
        age = (time - BEGINS) % ROUND if time >= BEGINS else -1.0
        return tuple(
            fe.Touch(one.place[0] * size[0], one.place[1] * size[1], _rise(one, age) * full)
            for one in WEIGHTS
            if one.begun < age < one.ended
            for full in [max(one.force * force[1], force[0])]
        )

    return touches


def _rise(one: Weight, age: float) -> float:
    return min(1.0, (age - one.begun) / LAID, (one.ended - age) / TAKEN)


def melody(size: tuple[float, float], force: tuple[float, float]) -> Script:
    """Play a tune on the keys of the plate with one finger, loud and soft, over and over.

    Parameters
    ----------
    size : (float, float), mm
    force : (float, float), N
        Smallest and largest of a touch.
    """
    keys = {key.pitch: key for key in lay_keys(size).keys}
    lowest = min(keys)
    starts = [0, *accumulate(BEATS)]
    whole = starts[-1] * BEAT + REST

    def touches(time: float) -> tuple[fe.Touch, ...]:
        age = (time - BEGINS) % whole if time >= BEGINS else -1.0
        number = int(np.searchsorted(starts, age / BEAT, "right")) - 1
        if not 0 <= number < len(TUNE) or lowest + TUNE[number] not in keys:
            return ()
        x, y = _middle(keys[lowest + TUNE[number]])
        since, held = age - starts[number] * BEAT, HELD * BEATS[number] * BEAT
        loud = 1.0 if BEATS[number] > 1 else 0.5 + 0.25 * (number % 2)
        attack = ATTACK[1] + loud * (ATTACK[0] - ATTACK[1])
        rise = min(1.0, since / attack, (held - since) / attack)
        if rise <= 0.0:
            return ()
        return (fe.Touch(x, y, rise * max(loud * force[1], force[0])),)

    return touches


def _middle(key: Key) -> tuple[float, float]:
    """Where a finger strikes a key: in the lower half, free of the black ones."""
    return (key.low[0] + key.high[0]) / 2, key.low[1] + 0.25 * (key.high[1] - key.low[1])

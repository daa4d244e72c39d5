"""A row of piano keys on a plate: which key lies where."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

OCTAVE = 23.5 * 7  # mm of a piano
WHITES = (0, 2, 4, 5, 7, 9, 11)  # semitones of the white keys above a C
LOWEST = 60  # middle C
INSET = 0.1  # of each side, free at the edges, where a clamped plate feels least
TALLEST = 150.0  # mm, of a white key of a piano
NARROW, SHORT = 0.58, 0.62  # width and length of a black key over those of a white one


class Key(NamedTuple):
    """One key: its pitch as MIDI counts, its lower left and upper right corners, mm."""

    pitch: int
    low: tuple[float, float]
    high: tuple[float, float]
    black: bool

    def holds(self, x: float, y: float) -> bool:
        """Whether a place, mm, lies on it."""
        return self.low[0] <= x < self.high[0] and self.low[1] <= y <= self.high[1]


@dataclass(frozen=True)
class Keyboard:
    """Keys from left to right, the white ones first; a black one lies on two white ones."""

    keys: tuple[Key, ...]

    def pitch_at(self, x: float, y: float) -> int | None:
        """Pitch of the key at a place, mm; None beside the keys."""
        return next((key.pitch for key in reversed(self.keys) if key.holds(x, y)), None)


def lay_keys(plate_size: tuple[float, float]) -> Keyboard:
    """Lay as many white keys from middle C on as fit a plate at about the width of a piano's."""
    a, b = plate_size
    left, wide = INSET * a, (1 - 2 * INSET) * a
    count = max(round(wide / (OCTAVE / 7)), 1)
    tall = min((1 - 2 * INSET) * b, TALLEST)
    bottom, step = (b - tall) / 2, wide / count
    whites = [
        Key(
            LOWEST + 12 * (number // 7) + WHITES[number % 7],
            (left + number * step, bottom),
            (left + (number + 1) * step, bottom + tall),
            False,
        )
        for number in range(count)
    ]
    pitches = {key.pitch for key in whites}
    blacks = [
        Key(
            key.pitch + 1,
            (key.high[0] - NARROW * step / 2, bottom + (1 - SHORT) * tall),
            (key.high[0] + NARROW * step / 2, bottom + tall),
            True,
        )
        for key in whites[:-1]
        if key.pitch + 1 not in pitches
    ]
    return Keyboard((*whites, *blacks))

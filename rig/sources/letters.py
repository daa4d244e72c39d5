"""Letters as a finger writes them: strokes on the plate, lifted between two."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from rig.sources.script import Script, ScriptedPress

STROKES = {
    "A": "00 26 40, 13 33", "B": "00 06 36 45 44 33 03, 33 42 41 30 00",
    "C": "45 36 16 05 01 10 30 41", "D": "00 06 26 44 42 20 00", "E": "46 06 00 40, 03 33",
    "F": "46 06 00, 03 33", "G": "45 36 16 05 01 10 30 41 43 23", "H": "06 00, 46 40, 03 43",
    "I": "26 20", "J": "46 41 30 10 01", "K": "06 00, 46 03 40", "L": "06 00 40",
    "M": "00 06 23 46 40", "N": "00 06 40 46", "O": "16 05 01 10 30 41 45 36 16",
    "P": "00 06 36 45 44 33 03", "Q": "16 05 01 10 30 41 45 36 16, 22 40",
    "R": "00 06 36 45 44 33 03, 23 40", "S": "45 36 16 05 04 13 33 42 41 30 10 01",
    "T": "06 46, 26 20", "U": "06 01 10 30 41 46", "V": "06 20 46", "W": "06 10 23 30 46",
    "X": "06 40, 46 00", "Y": "06 23 46, 23 20", "Z": "06 46 00 40",
}  # fmt: skip
"""Corners of the strokes of each letter on a grid of 4 by 6, x and y."""

SPAN = (0.14, 0.86)
"""Fractions of the side along x that a text fills; its letters are twice as high as wide."""

GAP = 0.35  # of the width of a letter, between two
PACE = 0.35
"""Of the side along x, what a finger passes in a second when nothing is said."""

LIFTED = 0.25  # s between two strokes
RAMPS = 0.3  # s that a finger stands still at the beginning of a stroke, until it presses


def letters(
    size: tuple[float, float], text: str, force: float, start: float, pace: float = PACE
) -> Script:
    """Write a text once, with a constant force.

    Parameters
    ----------
    size
        Sides of the plate, mm.
    text
        Letters A to Z and blanks.
    force
        N.
    start
        When the finger lands, s.
    pace
        Of the side along x that the finger passes in a second.

    Raises
    ------
    ValueError
        If the text is empty or has other signs.
    """
    presses = strokes(size, text, force, start, pace)

    def touches(time: float):
        at = (press.at(time, size) for press in presses)
        return tuple(touch for touch in at if touch is not None)

    return touches


def strokes(
    size: tuple[float, float], text: str, force: float, start: float, pace: float = PACE
) -> tuple[ScriptedPress, ...]:
    """Return the presses that write a text; see `letters`."""
    wrong = sorted({sign for sign in text.upper() if sign not in STROKES and sign != " "})
    if wrong or not text.strip():
        said = f"has {', '.join(repr(sign) for sign in wrong)}" if wrong else "is empty"
        raise ValueError(f"text '{text}' {said}; a finger writes letters A to Z")
    low, high = SPAN
    wide = (high - low) / (len(text) + GAP * (len(text) - 1))
    tall = min(2.0 * wide * size[0] / size[1], high - low)
    presses: list[ScriptedPress] = []
    for number, letter in enumerate(text.upper()):
        corner = low + number * wide * (1.0 + GAP), 0.5 - 0.5 * tall
        for stroke in STROKES.get(letter, "").split(", "):
            if not stroke:
                continue
            path = [
                (corner[0] + wide * int(x) / 4.0, corner[1] + tall * int(y) / 6.0)
                for x, y in stroke.split()
            ]
            presses.append(_press(path, size, (force, pace), start))
            start += presses[-1].duration + LIFTED
    return tuple(presses)


def _press(
    corners: list[tuple[float, float]],
    size: tuple[float, float],
    force_pace: tuple[float, float],
    start: float,
) -> ScriptedPress:
    """Draw a stroke at a constant pace; it stands still while the finger lands and leaves."""
    sides = np.array(size)
    lengths = [float(np.linalg.norm((np.array(b) - a) * sides)) for a, b in pairwise(corners)]
    force, pace = force_pace[0], force_pace[1] * size[0]
    times = np.cumsum([0.0, RAMPS, *(each / pace for each in lengths), RAMPS])
    places = np.array([corners[0], *corners, corners[-1]])
    whole = float(times[-1])
    even: list[float] = np.linspace(0.0, whole, max(round(whole / 0.02), 2)).tolist()
    path = tuple(
        (float(np.interp(time, times, places[:, 0])), float(np.interp(time, times, places[:, 1])))
        for time in even
    )
    return ScriptedPress(start, whole, path, (force, force))

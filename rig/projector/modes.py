"""Where the marks of touches go: on them, beside them, or off the plate altogether."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from rig.live.snapshot import Mark

Mode = Literal["on", "beside", "outside", "dark"]
"""On the touch; beside it; outside the measured area; on it, but only in frames not measured."""

BESIDE = 30.0  # mm: the spot of a hard touch is dark there, and the strain of the touch has decayed
OUTSIDE = 10.0  # mm beyond the edge


def placed(marks: Sequence[Mark], mode: Mode, plate_size: tuple[float, float]) -> tuple[Mark, ...]:
    """Move marks to where a mode shows them.

    Parameters
    ----------
    marks : sequence of Mark
        Touches as they were found.
    mode : {"on", "beside", "outside", "dark"}
        "beside" moves a mark `BESIDE` mm towards the middle of the plate, "outside" puts two for
        each touch on the margin: one at its x and one at its y, beyond the nearer edges.
    plate_size : (a, b), mm
    """
    match mode:
        case "beside":
            return tuple(_beside(mark, plate_size) for mark in marks)
        case "outside":
            return tuple(part for mark in marks for part in _outside(mark, plate_size))
        case _:
            return tuple(marks)


def _beside(mark: Mark, size: tuple[float, float]) -> Mark:
    towards = np.array([size[0] / 2 - mark.x, size[1] / 2 - mark.y])
    far = float(np.hypot(*towards))
    along = towards / far if far > 1.0 else np.array([1.0, 0.0])
    x, y = np.array([mark.x, mark.y]) + BESIDE * along
    return replace(mark, x=float(x), y=float(y))


def _outside(mark: Mark, size: tuple[float, float]) -> tuple[Mark, Mark]:
    """Put marks at the x and at the y of a touch; without the ring, which means both at once."""
    dot = replace(mark, sigma=(0.0, 0.0, 0.0))
    x, y = (
        -OUTSIDE if place < side / 2 else side + OUTSIDE
        for place, side in zip((mark.x, mark.y), size, strict=True)
    )
    return replace(dot, y=y), replace(dot, x=x)

"""Marks are drawn where touches will be when the light arrives, not where they were seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.live.snapshot import Mark

FURTHEST = 25.0  # mm; a stroke of 250 mm/s for a tenth of a second


def predicted(
    marks: Sequence[Mark], ahead: float, plate_size: tuple[float, float]
) -> tuple[Mark, ...]:
    """Carry marks on at the velocity of their touches, as far as the plate goes.

    Parameters
    ----------
    marks : sequence of Mark
    ahead : float, s
        From the capture of the frame that they were found in to the light.
    plate_size : (a, b), mm
    """
    return tuple(_predicted(mark, ahead, plate_size) for mark in marks)


def _predicted(mark: Mark, ahead: float, plate_size: tuple[float, float]) -> Mark:
    step = ahead * np.array(mark.velocity)
    far = float(np.hypot(*step))
    if far == 0.0:
        return mark
    place = np.array([mark.x, mark.y]) + step * min(1.0, FURTHEST / far)
    x, y = np.clip(place, 0.0, plate_size).tolist()
    return replace(mark, x=x, y=y)

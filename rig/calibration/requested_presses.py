"""The known presses that a collection asks for: places and forces that cover the plate evenly."""

from __future__ import annotations

import numpy as np

import fe

REQUESTED = 30  # presses of a collection
BORDER = 0.15  # of a side that they keep from the edge
ROOT = 1.2207440846057596  # of x⁴ = x + 1


def requested_presses(
    size: tuple[float, float], force: tuple[float, float], seed: int
) -> tuple[fe.Touch, ...]:
    """Draw the known presses that `collect` asks for, in their order.

    Any part of the sequence covers the plate (R3 of Roberts 2018, "The unreasonable effectiveness
    of quasirandom sequences"), so that a session may be ended early.

    Parameters
    ----------
    size : (float, float), mm
        Sides of the plate.
    force : (float, float), N
        Smallest and largest.
    seed : int
    """
    begin = np.random.default_rng(seed).uniform(size=3)
    fraction = (begin + np.outer(np.arange(REQUESTED), ROOT ** -np.arange(1.0, 4.0))) % 1.0
    low = np.array([BORDER * size[0], BORDER * size[1], force[0]])
    high = np.array([(1 - BORDER) * size[0], (1 - BORDER) * size[1], force[1]])
    return tuple(fe.Touch(*press) for press in (low + fraction * (high - low)).tolist())

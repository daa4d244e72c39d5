"""Pixels at black or at white: where a camera clips, grey levels say nothing of the pattern."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import F64, I64, AnyArray
from dic.compiled import njit
from dic.fields.displacement import Status
from dic.images.image import check_image

UNUSABLE = 2 / 3
"""Fraction of a subset, or of an image, at black or at white from which it cannot be trusted."""


def white(image: AnyArray) -> int:
    """Grey level at which the sensor clips: 10, 12 and 14 bit cameras also write uint16."""
    brightest = int(image.max())
    return next((2**b - 1 for b in (8, 10, 12, 14) if brightest == 2**b - 1), 2**16 - 1)


def levels(image: AnyArray) -> tuple[tuple[int, Status], ...]:
    """Name black and white of an image; nothing if it is float, whose range is not known."""
    if not np.issubdtype(image.dtype, np.integer):
        return ()
    return (0, Status.DARK), (white(image), Status.SATURATED)


def clipped_status(image: ArrayLike) -> Status | None:
    """Say whether an image is black or white for the most part.

    Parameters
    ----------
    image : (H, W) uint8, uint16 or float, grey levels

    Returns
    -------
    Status or None
        DARK or SATURATED; None of any other image, and of float, whose range is not known.

    Raises
    ------
    ValueError
        The image cannot be used.
    """
    grey = check_image(image, "deformed")
    return next((name for level, name in levels(grey) if np.mean(grey == level) > UNUSABLE), None)


def gained(
    reference: AnyArray, image: AnyArray, xy: AnyArray, moved: AnyArray, half: int
) -> list[tuple[F64, Status]]:
    """Measure how much more of each subset a frame clips than the reference did.

    Parameters
    ----------
    reference, image : (H, W), grey levels
    xy, moved : (N, 2), px
        The points before and after; NaN where there is none.
    half : int, px

    Returns
    -------
    list of ((N,) float64, Status)
        Fraction of the subset, 0…1, and DARK or SATURATED.
    """
    finite = np.flatnonzero(np.isfinite(moved).all(axis=1))
    if not len(finite):
        return []
    found: list[tuple[F64, Status]] = []
    for level, name in levels(image):
        more = _count(image, level, moved[finite], half) - _count(
            reference, level, xy[finite], half
        )
        fraction = np.zeros(len(xy))
        fraction[finite] = np.maximum(more, 0) / (2 * half + 1) ** 2
        found.append((fraction, name))
    return found


@njit(cache=True, nogil=True)
def _count(image: AnyArray, level: int, xy: F64, half: int) -> I64:
    """Count the pixels of each subset on the image that have the grey level, (N,)."""
    rows, columns = image.shape
    count = np.zeros(xy.shape[0], np.int64)
    for n in range(xy.shape[0]):
        x, y = round(xy[n, 0]), round(xy[n, 1])
        for j in range(max(y - half, 0), min(y + half + 1, rows)):
            for i in range(max(x - half, 0), min(x + half + 1, columns)):
                count[n] += image[j, i] == level
    return count

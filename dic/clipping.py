"""Pixels at black or at white: where a camera clips, grey levels say nothing of the pattern."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dic.displacement import Status
from dic.quality import box_sums, lies_inside

_GAINED = 0.1  # share of a subset that may clip in the frame and not in the reference


def white(image: NDArray) -> int:
    """Grey level at which the sensor clips: 10, 12 and 14 bit cameras also write uint16."""
    brightest = int(image.max())
    return next((2**b - 1 for b in (8, 10, 12, 14) if brightest == 2**b - 1), 2**16 - 1)


def levels(image: NDArray) -> tuple[tuple[int, Status], ...]:
    """Name black and white of a picture; nothing if it is float, whose range is not known."""
    if not np.issubdtype(image.dtype, np.integer):
        return ()
    return (0, Status.DARK), (white(image), Status.SATURATED)


def gained(
    reference: NDArray, image: NDArray, xy: NDArray, moved: NDArray, half: int
) -> list[tuple[NDArray[np.bool_], Status]]:
    """Find the subsets of which a frame clips more than the reference did.

    Parameters
    ----------
    reference, image : (H, W), grey levels
    xy, moved : (N, 2), px
        The points before and after; NaN where that is not known.
    half : int, px

    Returns
    -------
    list of ((N,) bool, Status)
        Where, and DARK or SATURATED.
    """
    found, side = [], 2 * half + 1
    for level, name in levels(image):
        clipped = image == level
        if np.count_nonzero(clipped) <= _GAINED * side * side:
            continue
        share = _share(clipped, moved, half) - _share(reference == level, xy, half)
        found.append((share > _GAINED, name))
    return found


def _share(clipped: NDArray[np.bool_], xy: NDArray, half: int) -> NDArray[np.float64]:
    """Share of each subset that is clipped, (N,); 0 where it is not on the picture."""
    share = np.zeros(len(xy))
    known = np.flatnonzero(np.isfinite(xy).all(axis=1))
    centres = np.rint(xy[known]).astype(np.int64)
    inside = lies_inside(centres, half, clipped.shape)
    share[known[inside]] = box_sums(clipped, centres[inside], half) / (2 * half + 1) ** 2
    return share

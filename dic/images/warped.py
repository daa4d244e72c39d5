"""A whole image, read where a displacement of every pixel takes it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import F32
from dic.compiled import njit
from dic.images.warp import PAD, TAPS, warp_row
from dic.numbers import check_array, read_array


def warp_image(spline: F32, motion: ArrayLike) -> F32:
    """Read an image back from where its pixels have moved.

    Parameters
    ----------
    spline : (H + 2 PAD, W + 2 PAD) float32
        Coefficients of the image, as of `dic.spline_coefficients`.
    motion : (2, H, W) float, px
        u and v of each pixel; places off the image are moved to its edge.

    Returns
    -------
    (H, W) float32, grey levels

    Raises
    ------
    ValueError
        The coefficients are not of two dimensions, or the motion is not of their image or is NaN
        somewhere.
    """
    coefficients = check_array(spline, "spline", "f", 2)
    given = read_array(motion, "motion", "px")
    shape = tuple(n - 2 * PAD for n in coefficients.shape)
    if min(shape) < 1 or given.shape != (2, *shape):
        raise ValueError(
            f"motion must be (2, H, W) px of the image of the spline, {shape}, got {given.shape}; "
            "take the coefficients of dic.spline_coefficients and a motion of every pixel"
        )
    if not np.isfinite(given).all():
        raise ValueError("motion holds NaN; fill it with that of the nearest pixel that has one")
    out = np.empty(shape, np.float32)
    _warp(np.ascontiguousarray(coefficients, np.float32), given.astype(np.float32), out)
    return out


@njit(cache=True, nogil=True)
def _warp(spline: F32, motion: F32, out: F32) -> None:
    height, width = out.shape
    cells, taps = np.empty((2, width), np.int32), np.empty((2, TAPS, width), np.float32)
    for y in range(height):
        warp_row(spline, (0, y), motion[0, y], motion[1, y], cells, taps, out[y])

"""A block of an image moved by one fraction of a pixel: filter of the spline and its value at once.

Where all pixels of a block move alike, filtering and interpolating them is one convolution along
each axis. Its taps fall by 0.43 from pixel to pixel, so that a small block needs few pixels around
it, and no line of it waits for the one before, as in the recursion of `dic.images.spline`.
"""

from __future__ import annotations

import numpy as np

from dic.arrays import F32, AnyArray
from dic.compiled import njit
from dic.images.block import cut
from dic.images.prefilter import gaussian_taps
from dic.images.spline import impulse_response
from dic.images.warp import TAPS, weights

_REACH = 17
"""Pixels to which the response of the filter is taken; what lies beyond goes to the last of them.

With a Gaussian of 0 px this fills whole chunks of taps. The rest is 1e-7 of the response.
"""
_CHUNK = 8  # taps in one pass over a line


def response(sigma: float) -> F32:
    """Coefficients that a single pixel of 1 leaves behind a Gaussian of `sigma` px, (2 R + 1,)."""
    alone = impulse_response(_REACH)
    alone[[0, -1]] += (1.0 - alone.sum()) / 2
    whole = np.convolve(alone, gaussian_taps(sigma).astype(np.float64))
    return np.asarray(whole / whole.sum(), dtype=np.float32)


def tap_count(behind: F32) -> int:
    """Count the taps of a response and the spline together, in whole chunks."""
    return -(-(len(behind) + TAPS - 1) // _CHUNK) * _CHUNK


@njit(cache=True, nogil=True)
def shift_block(
    image: AnyArray,
    corner: tuple[int, int],
    fraction: tuple[np.float32, np.float32],
    behind: F32,
    scratch: tuple[F32, F32, F32],
    out: F32,
) -> None:
    """Write an image at places (x, y) that lie a fraction of a px beyond its pixels.

    Parameters
    ----------
    corner : (x, y), px
        Of the block.
    behind : (2 R + 1,) float32
        As `response` makes it.
    scratch : tuple
        Taps (2, T) along x and y; pixels (H + T - 1, W + T - 1) that they reach; two blocks whose
        rows are as long as those, (2, ·).
    out : (H, W) float32
        Less the level of the middle.
    """
    taps, part, lines = scratch
    rim, count, line = 2 + behind.shape[0] // 2, taps.shape[1], part.shape[1]
    _fuse(behind, fraction[0], taps[0])
    _fuse(behind, fraction[1], taps[1])
    cut(image, corner[0] - rim, corner[1] - rim, part)
    size = out.shape[0] * line
    _convolve(part.ravel(), line, taps[1], size, lines[0])
    _convolve(lines[0], 1, taps[0], size - count + 1, lines[1])
    for j in range(out.shape[0]):
        row, into = lines[1, j * line : j * line + out.shape[1]], out[j]
        for i in range(into.shape[0]):
            into[i] = row[i]


@njit(cache=True, nogil=True)
def _fuse(behind: F32, fraction: np.float32, taps: F32) -> None:
    """Write the taps (`tap_count`,) for a fraction of a px, the first one for the first pixel."""
    knots = weights(fraction)
    taps[:] = 0
    for k in range(TAPS):
        for i in range(behind.shape[0]):
            taps[k + i] += knots[k] * behind[i]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _convolve(line: F32, stride: int, taps: F32, count: int, out: F32) -> None:
    """Write Σ taps[k] line[n + k·stride] of the first `count` places into `out`."""
    into = out[:count]
    for k in range(0, taps.shape[0], _CHUNK):
        a0, a1, a2, a3 = taps[k], taps[k + 1], taps[k + 2], taps[k + 3]
        a4, a5, a6, a7 = taps[k + 4], taps[k + 5], taps[k + 6], taps[k + 7]
        r0, r1, r2 = line[k * stride :], line[(k + 1) * stride :], line[(k + 2) * stride :]
        r3, r4, r5 = line[(k + 3) * stride :], line[(k + 4) * stride :], line[(k + 5) * stride :]
        r6, r7 = line[(k + 6) * stride :], line[(k + 7) * stride :]
        if k == 0:
            for n in range(count):
                into[n] = (
                    a0 * r0[n] + a1 * r1[n] + a2 * r2[n] + a3 * r3[n]
                    + a4 * r4[n] + a5 * r5[n] + a6 * r6[n] + a7 * r7[n]
                )  # fmt: skip
        else:
            for n in range(count):
                into[n] += (
                    a0 * r0[n] + a1 * r1[n] + a2 * r2[n] + a3 * r3[n]
                    + a4 * r4[n] + a5 * r5[n] + a6 * r6[n] + a7 * r7[n]
                )  # fmt: skip

"""Values of a quintic B-spline between the pixels: one by one, and a row of pixels at a time.

Neighbouring pixels move alike: along a run of them the whole part of the motion is the same, so
that their taps lie side by side in memory and the sum over the taps runs on vectors. A smooth
motion has long runs and is warped four times faster than pixel by pixel.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from dic.arrays import F32, I32
from dic.compiled import njit

Taps: TypeAlias = tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]

PAD = 3  # px of mirrored coefficients on each side, for the six taps at up to half a px outside
TAPS = 6
_SHORT = 6  # px, runs shorter than this gain nothing from vectors


@njit(cache=True, nogil=True, fastmath=True)
def sample(spline: F32, x: float, y: float) -> np.float32:
    """Value of the spline at (x, y) px; places off the image are moved to its edge."""
    height, width = spline.shape[0] - 2 * PAD, spline.shape[1] - 2 * PAD
    x = min(max(x, -0.5), width - 0.5)
    y = min(max(y, -0.5), height - 0.5)
    column, row = math.floor(x), math.floor(y)
    # The fraction is small, so single precision holds it; the place itself would lose 2e-4 px.
    a = weights(np.float32(x - column))
    b = weights(np.float32(y - row))
    i, j = row + PAD - 2, column + PAD - 2
    return (
        b[0] * _along(spline[i], j, a) + b[1] * _along(spline[i + 1], j, a)
        + b[2] * _along(spline[i + 2], j, a) + b[3] * _along(spline[i + 3], j, a)
        + b[4] * _along(spline[i + 4], j, a) + b[5] * _along(spline[i + 5], j, a)
    )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, inline="always")
def _along(row: F32, j: int, a: Taps) -> np.float32:
    return (
        a[0] * row[j] + a[1] * row[j + 1] + a[2] * row[j + 2]
        + a[3] * row[j + 3] + a[4] * row[j + 4] + a[5] * row[j + 5]
    )  # fmt: skip


def knot_weights(t: np.float32) -> Taps:
    """Weights of the knots -2 … 3 at the fraction t."""
    scale, one = np.float32(1 / 120), np.float32(1)
    s = one - t
    w0 = scale * s * s * s * s * s
    w5 = scale * t * t * t * t * t
    w1 = _near_outer(s)
    w4 = _near_outer(t)
    w2 = scale * (
        np.float32(66) - t * t * (np.float32(60) - t * t * (np.float32(30) - np.float32(10) * t))
    )
    return w0, w1, w2, one - w0 - w1 - w2 - w4 - w5, w4, w5


weights = njit(cache=True, nogil=True, fastmath=True, inline="always")(knot_weights)


@njit(cache=True, nogil=True, fastmath=True, inline="always")
def _near_outer(t: np.float32) -> np.float32:
    five, ten = np.float32(5), np.float32(10)
    return np.float32(1 / 120) * (
        np.float32(1) + t * (five + t * (ten + t * (ten + t * (five - five * t))))
    )


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def warp_row(
    spline: F32, place: tuple[int, int], u: F32, v: F32, cells: I32, taps: F32, out: F32
) -> None:
    """Sample the spline along a row that starts at `place` (x, y) and moves by (u, v) px.

    The scratch `cells` (2, n) int32 and `taps` (2, 6, n) float32 is the caller's.
    """
    x, y = place
    _split(np.float32(x), np.float32(1), spline.shape[1] - 2 * PAD, u, cells[0], taps[0])
    _split(np.float32(y), np.float32(0), spline.shape[0] - 2 * PAD, v, cells[1], taps[1])
    columns, rows = cells[0], cells[1]
    start, count = 0, u.shape[0]
    while start < count:
        end, column, row = start + 1, columns[start], rows[start]
        while end < count and columns[end] == column and rows[end] == row:
            end += 1
        i, j = y + row + PAD - 2, x + start + column + PAD - 2
        if end - start < _SHORT:
            _pixel_by_pixel(
                spline, i, j, taps[0, :, start:end], taps[1, :, start:end], out[start:end]
            )
        else:
            _run(spline, i, j, taps, start, out[start:end])
        start = end


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _split(
    first: np.float32, stride: np.float32, limit: int, shift: F32, cell: I32, taps: F32
) -> None:
    """Split a motion into whole px and the weights of its fraction, kept on the image."""
    half = np.float32(0.5)
    w0, w1, w2, w3, w4, w5 = taps[0], taps[1], taps[2], taps[3], taps[4], taps[5]
    for n in range(shift.shape[0]):
        x = first + stride * np.float32(n)
        u = min(max(shift[n], -half - x), np.float32(limit) - half - x)
        whole = math.floor(u)
        cell[n] = np.int32(whole)
        w0[n], w1[n], w2[n], w3[n], w4[n], w5[n] = weights(u - np.float32(whole))


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _run(spline: F32, i: int, j: int, taps: F32, start: int, out: F32) -> None:
    count = out.shape[0]
    end = start + count
    across = taps[0]
    a0, a1, a2 = across[0, start:end], across[1, start:end], across[2, start:end]
    a3, a4, a5 = across[3, start:end], across[4, start:end], across[5, start:end]
    for n in range(count):
        out[n] = np.float32(0)
    for k in range(TAPS):
        row, b = spline[i + k, j : j + count + TAPS - 1], taps[1, k, start:end]
        for n in range(count):
            out[n] += b[n] * (
                a0[n] * row[n] + a1[n] * row[n + 1] + a2[n] * row[n + 2]
                + a3[n] * row[n + 3] + a4[n] * row[n + 4] + a5[n] * row[n + 5]
            )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _pixel_by_pixel(spline: F32, i: int, j: int, across: F32, down: F32, out: F32) -> None:
    for n in range(out.shape[0]):
        a = across[0, n], across[1, n], across[2, n], across[3, n], across[4, n], across[5, n]
        total = np.float32(0)
        for k in range(TAPS):
            total += down[k, n] * _along(spline[i + k], j + n, a)
        out[n] = total

"""Sums over subsets, by running sums on a grid and one by one at scattered points.

A pixel contributes a row of terms; a row of pixels is summed under each subset and *lifted* by
powers of y; rows are summed under each subset. On a grid both sums are differences of running sums,
so the cost does not depend on the size of the subset. x and y are those of the picture.

Here are the sums of the reference, taken once; those of a frame stand in `dic.frame_moments`.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

_TERMS = 20  # of a pixel: products of (fx, fy, f, 1) and their moments along x
# (term, power of y), appended to the sums in this order.
_LIFT = np.array([(k, 1) for k in range(10)] + [(k, 2) for k in range(3)])
_SUMS = _TERMS + len(_LIFT)


@njit(cache=True, nogil=True, fastmath=True, inline="always")
def _add_terms(pixel, x, total):
    """Add (fx², fxfy, fy², fx f, fy f, fx, fy) · 1, x; the first three · x²; f², f, 1."""
    fx, fy, f, weight = (
        np.float64(pixel[0]),
        np.float64(pixel[1]),
        np.float64(pixel[2]),
        np.float64(pixel[3]),
    )
    terms = (fx * fx, fx * fy, fy * fy, fx * f, fy * f, fx, fy)
    for k in range(7):
        total[k] += terms[k]
        total[7 + k] += x * terms[k]
    for k in range(3):
        total[14 + k] += x * x * terms[k]
    total[17] += f * f
    total[18] += f
    total[19] += weight


@njit(cache=True, nogil=True, fastmath=True)
def add_row(running, y, xs, half, lift, total):
    """Add one row under each column of subsets to `total` (C, K), from running sums (W + 1, k)."""
    terms = running.shape[1]
    for c in range(xs.shape[0]):
        left, right = xs[c] - half, xs[c] + half + 1
        for k in range(terms):
            total[c, k] += running[right, k] - running[left, k]
        for k in range(lift.shape[0]):
            source = lift[k, 0]
            factor = y if lift[k, 1] == 1 else y * y
            total[c, terms + k] += factor * (running[right, source] - running[left, source])


@njit(cache=True, nogil=True, fastmath=True)
def _grid(texture, xs, ys, half, lift, out):
    running = np.zeros((texture.shape[1] + 1, _TERMS))
    total = np.zeros(out.shape[1:])
    opened, closed = 0, 0
    for y in range(ys[0] - half, ys[-1] + half + 1):
        while opened < ys.shape[0] and ys[opened] - half == y:
            out[opened] = -total
            opened += 1
        for x in range(texture.shape[1]):
            running[x + 1] = running[x]
            _add_terms(texture[y, x], float(x), running[x + 1])
        add_row(running, float(y), xs, half, lift, total)
        while closed < ys.shape[0] and ys[closed] + half == y:
            out[closed] += total
            closed += 1


@njit(cache=True, nogil=True, fastmath=True)
def _points(texture, centres, half, lift, out):
    row = np.empty(_TERMS)
    for n in range(centres.shape[0]):
        for y in range(centres[n, 1] - half, centres[n, 1] + half + 1):
            row[:] = 0
            for x in range(centres[n, 0] - half, centres[n, 0] + half + 1):
                _add_terms(texture[y, x], float(x), row)
            lift_row(row, float(y), lift, out[n])


@njit(cache=True, nogil=True, fastmath=True)
def lift_row(row, y, lift, total):
    """Add the terms of a row at y to `total`, and behind them those lifted by powers of y."""
    for k in range(row.shape[0]):
        total[k] += row[k]
    for k in range(lift.shape[0]):
        factor = y if lift[k, 1] == 1 else y * y
        total[row.shape[0] + k] += factor * row[lift[k, 0]]


def sums_on_grid(texture, xs, ys, half) -> NDArray[np.float64]:
    """Sum under each subset of a grid, (R·C, 33) float64.

    Parameters
    ----------
    texture : (H, W, 4) float32
        fx, fy, f and weight (0 or 1) of each pixel, the first three zero where the weight is.
    xs : (C,) int, px
    ys : (R,) int, px
    half : int, px
        (subset - 1) / 2.
    """
    out = np.empty((len(ys), len(xs), _SUMS))
    _grid(texture, xs, ys, half, _LIFT, out)
    return out.reshape(-1, _SUMS)


def sums_at_points(texture, centres, half) -> NDArray[np.float64]:
    """Sum around each of `centres` (N, 2) int, px: (N, 33) float64."""
    out = np.zeros((len(centres), _SUMS))
    _points(texture, centres, half, _LIFT, out)
    return out

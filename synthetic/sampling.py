"""Kernels of the fast images: a smooth field from control pixels, and light from a spline."""

# pyright: basic
# Kernels alone, which Numba types.

import numpy as np

from synthetic.arrays import F32
from synthetic.compiled import njit

# The displacement is known at every so many pixels and is a cubic in between.
CONTROL_PX = 8
# The sharp image goes this far beyond the image, for what moves into it.
BORDER_PX = 16


@njit(cache=True, nogil=True, fastmath=True)
def _cubic(t, weights):
    """Weights of the cubic convolution kernel (Keys 1981, a = −1/2) at fraction t."""
    half = np.float32(0.5)
    weights[0] = half * t * (t * (np.float32(2) - t) - np.float32(1))
    weights[1] = half * (t * t * (np.float32(3) * t - np.float32(5)) + np.float32(2))
    weights[2] = half * t * (t * (np.float32(4) - np.float32(3) * t) + np.float32(1))
    weights[3] = half * t * t * (t - np.float32(1))


@njit(cache=True, nogil=True, fastmath=True)
def moved_back(forward: F32, backward: F32, spacing: int) -> F32:
    """Forward field where the backward field came from, at each control point."""
    rows, columns = forward.shape[:2]
    along, down = np.empty(4, np.float32), np.empty(4, np.float32)
    moved = np.zeros_like(forward)
    for r in range(rows):
        for c in range(columns):
            x = min(max(c - backward[r, c, 0] / spacing, 0), columns - 1)
            y = min(max(r - backward[r, c, 1] / spacing, 0), rows - 1)
            left, top = min(int(x), columns - 2), min(int(y), rows - 2)
            _cubic(np.float32(x - left), along)
            _cubic(np.float32(y - top), down)
            for i in range(4):
                row = min(max(top + i - 1, 0), rows - 1)
                for j in range(4):
                    column = min(max(left + j - 1, 0), columns - 1)
                    weight = down[i] * along[j]
                    moved[r, c, 0] += weight * forward[row, column, 0]
                    moved[r, c, 1] += weight * forward[row, column, 1]
    return moved


@njit(cache=True, nogil=True, fastmath=True)
def sample(sharp: F32, backward: F32, spacing: int, oversample: int, light: F32) -> None:
    """Light of each pixel: the sharp image where the pixel came from."""
    height, width = light.shape
    weights = np.empty((spacing, 4), np.float32)
    for phase in range(spacing):
        _cubic(np.float32(phase / spacing), weights[phase])
    line = np.empty(backward.shape[1:], np.float32)
    x, y = np.empty(width, np.float32), np.empty(width, np.float32)
    for r in range(height):
        _row_of_controls(backward, r // spacing, weights[r % spacing], line)
        _sources(line, weights, r, oversample, sharp.shape, x, y)
        _sample_row(sharp, x, y, light[r])


@njit(cache=True, nogil=True, fastmath=True)
def _row_of_controls(backward, first, weights, line):
    for c in range(line.shape[0]):
        for k in range(2):
            line[c, k] = (
                weights[0] * backward[first, c, k]
                + weights[1] * backward[first + 1, c, k]
                + weights[2] * backward[first + 2, c, k]
                + weights[3] * backward[first + 3, c, k]
            )


@njit(cache=True, nogil=True, fastmath=True)
def _sources(line, weights, r, oversample, shape, x, y):
    """Places in the sharp image, kept two samples from its rim, of the pixels of row r."""
    scale, low = np.float32(oversample), np.float32(1)
    right, bottom = np.float32(shape[1] - 3), np.float32(shape[0] - 3)
    spacing = weights.shape[0]
    for first in range(line.shape[0] - 3):
        begin = first * spacing
        for phase in range(min(spacing, len(x) - begin)):
            dx, dy = np.float32(0), np.float32(0)
            for i in range(4):
                dx += weights[phase, i] * line[first + i, 0]
                dy += weights[phase, i] * line[first + i, 1]
            c = begin + phase
            x[c] = min(max((np.float32(c + BORDER_PX) - dx) * scale, low), right)
            y[c] = min(max((np.float32(r + BORDER_PX) - dy) * scale, low), bottom)


@njit(cache=True, nogil=True, fastmath=True)
def _spline(t):
    """Weights of the cubic B-spline at fraction t."""
    one, sixth = np.float32(1), np.float32(1 / 6)
    s = one - t
    first, last = s * s * s * sixth, t * t * t * sixth
    third = np.float32(2 / 3) - s * s * (one - np.float32(0.5) * s)
    return first, one - first - third - last, third, last


@njit(cache=True, nogil=True, fastmath=True)
def _sample_row(sharp, x, y, light):
    for c in range(len(x)):
        left, top = np.int32(x[c]), np.int32(y[c])
        a0, a1, a2, a3 = _spline(x[c] - np.float32(left))
        d0, d1, d2, d3 = _spline(y[c] - np.float32(top))
        j = left - 1
        r0, r1, r2, r3 = sharp[top - 1], sharp[top], sharp[top + 1], sharp[top + 2]
        light[c] = (
            d0 * (a0 * r0[j] + a1 * r0[j + 1] + a2 * r0[j + 2] + a3 * r0[j + 3])
            + d1 * (a0 * r1[j] + a1 * r1[j + 1] + a2 * r1[j + 2] + a3 * r1[j + 3])
            + d2 * (a0 * r2[j] + a1 * r2[j + 1] + a2 * r2[j + 2] + a3 * r2[j + 3])
            + d3 * (a0 * r3[j] + a1 * r3[j + 1] + a2 * r3[j + 2] + a3 * r3[j + 3])
        )

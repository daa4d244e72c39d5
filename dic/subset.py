"""One subset at a time: its pixels in one line, so that every loop over them runs on vectors.

The pixels stand in rows of `width`, the width of the block of coefficients that they need. So every
pixel takes its taps at the same distance behind its own place, row after row, as long as the whole
part of its motion is that of the block; where the motion passes a whole px inside the subset the
block is read once for each whole part, and each pixel keeps its own.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from dic.spline import filter_square
from dic.warp import PAD, TAPS, sample, weights

_SPREAD = 2  # px by which the whole part of the motion may differ within a subset
_SPARE = TAPS - 1 + _SPREAD  # columns of a block beyond the side of its subset
_RIM = 7  # px around a block in which the recursive filter forgets its border: 0.43^7 = 0.3 %
_DRIFT = 2  # px that a block may move before its part of the frame is filtered again
_BLOCKS = 6  # whole parts of the motion in one subset, above which pixels are sampled one by one
_PARENT = (0, 0, 0, 1, 1, 2)  # a monomial is its parent times ξ (0) or η (1)
_FACTOR = (0, 0, 1, 0, 1, 1)


@njit(cache=True, nogil=True)
def make_tools(side, count):
    """Make the arrays in which one subset is worked on, for `count` coefficients a component."""
    width = side + _SPARE
    part, pixels = width + 2 * (_RIM + _DRIFT), side * width
    return (
        np.empty((2, pixels), np.float32),  # ξ, η
        np.empty((2, pixels), np.float32),  # f, weight
        np.empty((2 * count, pixels), np.float32),  # fx·m, fy·m
        np.empty((2, pixels), np.float32),  # motion
        np.empty((2, pixels), np.int32),  # its whole part
        np.empty((2, TAPS, pixels), np.float32),  # weights of its fraction
        np.empty((2, pixels), np.float32),  # g, and g of one block
        np.zeros(width * width + 2 * _SPARE, np.float32),  # block
        np.empty((2, part, part), np.float32),  # part of the frame
        np.zeros(2, np.int64),  # its corner, px
    )


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def lay_out(texture, place, half, tools):
    """Write what the reference says of the subset around `place` (x, y)."""
    arm, light, jacobian = tools[0], tools[1], tools[2]
    side, count = 2 * half + 1, jacobian.shape[0] // 2
    width = side + _SPARE
    x, y = round(place[0]), round(place[1])
    light[:] = np.float32(0)
    jacobian[:] = np.float32(0)
    for j in range(side):
        line, row = j * width, y - half + j
        for i in range(width):
            # The columns beyond the side weigh nothing; they move with the last one.
            arm[0, line + i] = np.float32(min(x - half + i, x + half) - place[0])
            arm[1, line + i] = np.float32(row - place[1])
        for i in range(side):
            light[0, line + i] = texture[2, row, x - half + i]
            light[1, line + i] = texture[3, row, x - half + i]
            jacobian[0, line + i] = texture[0, row, x - half + i]
            jacobian[count, line + i] = texture[1, row, x - half + i]
    for a in range(2):
        for k in range(1, count):
            lower, factor = jacobian[a * count + _PARENT[k]], arm[_FACTOR[k]]
            into = jacobian[a * count + k]
            for n in range(into.shape[0]):
                into[n] = lower[n] * factor[n]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def warp(frame, filtered, place, c, half, tools):
    """Write g(x + u) for the motion c (2, P); False where the frame must be filtered as a whole.

    `frame` is the picture itself, of which a part is filtered here, or, if `filtered`, its
    coefficients.
    """
    arm, motion, whole = tools[0], tools[3], tools[4]
    left, top = round(place[0]) - half, round(place[1]) - half
    for a in range(2):
        _move(c[a], arm[0], arm[1], motion[a])
        _split(motion[a], whole[a], tools[5][a])
    low_x, many_x = _range(whole[0])
    low_y, many_y = _range(whole[1])
    blocks = many_x * many_y
    if max(many_x, many_y) > _SPREAD + 1 or blocks > _BLOCKS:
        if filtered:
            _one_by_one(frame, left, top, 2 * half + 1, motion, tools[6][0])
        return filtered
    if filtered:
        _read(frame, left + low_x - 2 + PAD, top + low_y - 2 + PAD, 2 * half + 1, tools[7])
    else:
        _read_part(frame, left + low_x - 2, top + low_y - 2, 2 * half + 1, tools)
    for dy in range(many_y):
        for dx in range(many_x):
            _interpolate(tools[7], dx, dy, 2 * half + 1 + _SPARE, tools[5], tools[6][1])
            _keep(whole, low_x + dx, low_y + dy, tools[6][1], tools[6][0])
    return True


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _move(c, xi, eta, out):
    c0, c1, c2 = np.float32(c[0]), np.float32(c[1]), np.float32(c[2])
    for n in range(out.shape[0]):
        out[n] = c0 + c1 * xi[n] + c2 * eta[n]
    if c.shape[0] > 3:
        c3, c4, c5 = np.float32(c[3]), np.float32(c[4]), np.float32(c[5])
        for n in range(out.shape[0]):
            out[n] += c3 * xi[n] * xi[n] + c4 * xi[n] * eta[n] + c5 * eta[n] * eta[n]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _split(motion, whole, taps):
    """Split a motion into its whole part and the weights of its fraction."""
    w0, w1, w2, w3, w4, w5 = taps[0], taps[1], taps[2], taps[3], taps[4], taps[5]
    for n in range(motion.shape[0]):
        floor = math.floor(motion[n])
        whole[n] = np.int32(floor)
        w0[n], w1[n], w2[n], w3[n], w4[n], w5[n] = weights(motion[n] - np.float32(floor))


@njit(cache=True, nogil=True)
def _range(whole):
    low, high = whole[0], whole[0]
    for n in range(whole.shape[0]):
        low, high = min(low, whole[n]), max(high, whole[n])
    return np.int64(low), np.int64(high) - np.int64(low) + 1


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _interpolate(block, dx, dy, width, taps, out):
    across = taps[0]
    a0, a1, a2, a3, a4, a5 = across[0], across[1], across[2], across[3], across[4], across[5]
    for n in range(out.shape[0]):
        out[n] = np.float32(0)
    for k in range(TAPS):
        start, b = (dy + k) * width + dx, taps[1, k]
        row = block[start : start + out.shape[0] + TAPS]
        for n in range(out.shape[0]):
            out[n] += b[n] * (
                a0[n] * row[n] + a1[n] * row[n + 1] + a2[n] * row[n + 2]
                + a3[n] * row[n + 3] + a4[n] * row[n + 4] + a5[n] * row[n + 5]
            )  # fmt: skip


@njit(cache=True, nogil=True)
def _keep(whole, x, y, value, out):
    """Take the value where the whole part of the motion is (x, y)."""
    columns, rows = whole[0], whole[1]
    for n in range(out.shape[0]):
        out[n] = value[n] if columns[n] == x and rows[n] == y else out[n]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _one_by_one(spline, left, top, side, motion, out):
    width = side + _SPARE
    for n in range(out.shape[0]):
        row, column = n // width, min(n % width, side - 1)
        out[n] = sample(spline, left + column + motion[0, n], top + row + motion[1, n])


@njit(cache=True, nogil=True)
def _read(plane, x, y, side, block):
    """Copy a block from a plane; beyond its border stands the nearest value."""
    width, (rows, columns) = side + _SPARE, plane.shape
    for j in range(width):
        line = plane[min(max(y + j, 0), rows - 1)]
        if x >= 0 and x + width <= columns:
            for i in range(width):
                block[j * width + i] = line[x + i]
        else:
            for i in range(width):
                block[j * width + i] = line[min(max(x + i, 0), columns - 1)]


@njit(cache=True, nogil=True)
def _read_part(image, x, y, side, tools):
    """Copy a block from the filtered part of the frame, which is filtered anew if it must move."""
    part, corner = tools[8], tools[9]
    away_x, away_y = x - corner[0], y - corner[1]
    if min(away_x, away_y) < _RIM or max(away_x, away_y) > _RIM + 2 * _DRIFT:
        corner[0], corner[1] = x - _RIM - _DRIFT, y - _RIM - _DRIFT
        _cut(image, corner[0], corner[1], part[0])
        filter_square(part)
        away_x = away_y = _RIM + _DRIFT
    _read(part[0], away_x, away_y, side, tools[7])


@njit(cache=True, nogil=True)
def _cut(image, x, y, part):
    """Copy a square of the picture, mirrored at its border, less the grey level of its middle."""
    (rows, columns), size = image.shape, part.shape[0]
    level = np.float32(image[_mirror(y + size // 2, rows), _mirror(x + size // 2, columns)])
    inside = x >= 0 and x + size <= columns
    for j in range(size):
        line = image[_mirror(y + j, rows)]
        if inside:
            for i in range(size):
                part[j, i] = np.float32(line[x + i]) - level
        else:
            for i in range(size):
                part[j, i] = np.float32(line[_mirror(x + i, columns)]) - level


@njit(cache=True, nogil=True)
def _mirror(i, count):
    if i < 0:
        i = -i
    if i >= count:
        i = 2 * count - 2 - i
    return min(max(i, 0), count - 1)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def correlate_with(tools, sums):
    """Sum Jᵀg into `sums`: fx·m, fy·m, then -f and -1 as in `dic.normal`; and return Σg²."""
    g, f, weight, jacobian = tools[6][0], tools[1][0], tools[1][1], tools[2]
    gg, fg, total = 0.0, 0.0, 0.0
    for n in range(g.shape[0]):
        value = np.float64(g[n] * weight[n])
        gg += value * value
        fg += value * np.float64(f[n])
        total += value
    for k in range(jacobian.shape[0]):
        row, product = jacobian[k], np.float32(0)
        for n in range(g.shape[0]):
            product += row[n] * g[n]
        sums[k] = product
    sums[jacobian.shape[0]], sums[jacobian.shape[0] + 1] = -fg, -total
    return gg

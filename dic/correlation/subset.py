"""One subset at a time: its pixels in one line, so that every loop over them runs on vectors.

The pixels stand in rows of `width`, the width of the block of coefficients that they need. So every
pixel takes its taps at the same distance behind its own place, row after row, as long as the whole
part of its motion is that of the block; where the motion passes a whole px inside the subset the
block is read once for each whole part, and each pixel keeps its own.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from dic.arrays import F32, F64, I32, I64, AnyArray
from dic.compiled import njit
from dic.images.block import RIM, read, read_part
from dic.images.prefilter import gaussian_taps
from dic.images.shifted import response, shift_block, tap_count
from dic.images.warp import PAD, TAPS, sample, weights

if TYPE_CHECKING:
    from dic.correlation.reference import Reference

Tools: TypeAlias = tuple[F32, F32, F32, F32, I32, F32, F32, F32, F32, I64, F32, F32, F32, F32, F32]

_SPREAD = 2  # px by which the whole part of the motion may differ within a subset
_SPARE = TAPS - 1 + _SPREAD  # columns of a block beyond the side of its subset
_VECTOR = 32  # px, loops over whole multiples of it leave no remainder
_GENTLE = 0.03  # px by which a subset may deform and still be warped as if it did not
LOST, SHIFTED, WARPED = 0, 1, 2  # what `warp` did
_BLOCKS = 6  # whole parts of the motion in one subset, above which pixels are sampled one by one
_PARENT = (0, 0, 0, 1, 1, 2)  # a monomial is its parent times ξ (0) or η (1)
_FACTOR = (0, 0, 1, 0, 1, 1)


def subsets_of(ref: Reference, here: I64) -> F32:
    """Texture (M, 4, pixels) of some points of a reference."""
    if ref.subsets is None:
        return gather(ref.texture, ref.xy[here], ref.half)
    return ref.subsets if len(here) == len(ref.xy) else ref.subsets[here]


@njit(cache=True, nogil=True)
def gather(texture: F32, xy: F64, half: int) -> F32:
    """Copy fx, fy, f and weight of the subsets around `xy` (N, 2) px, (N, 4, pixels) float32.

    What lies beyond the image is left at zero.
    """
    side, (height, width) = 2 * half + 1, texture.shape[1:]
    out = np.zeros((xy.shape[0], 4, side * (side + _SPARE)), np.float32)
    for n in range(xy.shape[0]):
        left, top = round(xy[n, 0]) - half, round(xy[n, 1]) - half
        first, last = max(0, -left), min(side, width - left)
        for a in range(4):
            for j in range(max(0, -top), min(side, height - top)):
                line, row = out[n, a, j * (side + _SPARE) :], texture[a, top + j, left + first :]
                for i in range(last - first):
                    line[first + i] = row[i]
    return out


def make_tools(half: int, count: int, sigma: float) -> Tools:
    """Make the arrays in which one subset is worked on, for `count` coefficients a component.

    `sigma` px is the Gaussian that a frame passes first.
    """
    side = 2 * half + 1
    width, taps, behind = side + _SPARE, gaussian_taps(sigma), response(sigma)
    rim = RIM + len(taps) // 2
    part, pixels = (width + 2 * rim) // _VECTOR * _VECTOR + _VECTOR, side * width
    more = tap_count(behind)
    return (
        np.empty((2, pixels), np.float32),  # ξ, η
        offsets(half),  # about the middle of the subset
        np.empty((2 * count, pixels), np.float32),  # fx·m, fy·m
        np.empty((2, pixels), np.float32),  # motion
        np.empty((2, pixels), np.int32),  # its whole part
        np.empty((2, TAPS, pixels), np.float32),  # weights of its fraction
        np.empty((2, pixels), np.float32),  # g, and g of one block
        np.zeros((2, width * width + 2 * _SPARE), np.float32),  # block, and it weighed along x
        np.empty((2, part, part), np.float32),  # part of the frame
        np.zeros(2, np.int64),  # its corner, px
        taps,  # of the prefilter
        behind,  # coefficients that a pixel leaves behind prefilter and spline
        np.empty((2, more), np.float32),  # taps of a shift along x and y
        np.empty((side + more - 1, side + more - 1), np.float32),  # pixels that these reach
        np.zeros((2, side * (side + more - 1) + _SPARE), np.float32),  # shifted along y, and both
    )


def offsets(half: int) -> F32:
    """Columns and rows of the pixels about the middle of a subset, (2, pixels)."""
    side = 2 * half + 1
    rows, columns = np.mgrid[:side, : side + _SPARE]
    # The columns beyond the side weigh nothing; they move with the last one.
    columns = np.minimum(columns, side - 1)
    return np.stack([columns, rows]).reshape(2, -1).astype(np.float32) - half


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def lay_out(pixels: F32, place: F64, tools: Tools) -> None:
    """Write ξ, η and fx·m, fy·m of the subset (4, pixels) around `place` (x, y)."""
    arm, middle, jacobian = tools[0], tools[1], tools[2]
    count = jacobian.shape[0] // 2
    for a in range(2):
        aside = np.float32(round(place[a]) - place[a])
        for n in range(arm.shape[1]):
            arm[a, n] = middle[a, n] + aside
    for a in range(2):
        first = jacobian[a * count]
        for n in range(first.shape[0]):
            first[n] = pixels[a, n]
        for k in range(1, count):
            lower, factor = jacobian[a * count + _PARENT[k]], arm[_FACTOR[k]]
            into = jacobian[a * count + k]
            for n in range(into.shape[0]):
                into[n] = lower[n] * factor[n]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def warp(frame: AnyArray, filtered: bool, place: F64, c: F64, half: int, tools: Tools) -> int:
    """Write g(x + u) for the motion c (2, P) of a subset.

    `frame` is the image itself, of which a part is filtered here, or, if `filtered`, its
    coefficients.

    Returns
    -------
    int
        WARPED; or SHIFTED by u at the place alone, where the subset deforms so little that ∇f holds
        for what is left, an error of the order of `_GENTLE`² that no bias shows; or LOST, where the
        subset deforms so much that it needs the frame filtered as a whole.
    """
    arm, motion, whole = tools[0], tools[3], tools[4]
    left, top = round(place[0]) - half, round(place[1]) - half
    if _is_gentle(c, half):
        _shift(frame, filtered, left, top, c[0, 0], c[1, 0], 2 * half + 1, tools)
        return SHIFTED
    for a in range(2):
        _move(c[a], arm[0], arm[1], motion[a])
        _split(motion[a], whole[a], tools[5][a])
    low_x, many_x = _range(motion[0])
    low_y, many_y = _range(motion[1])
    blocks = many_x * many_y
    if max(many_x, many_y) > _SPREAD + 1 or blocks > _BLOCKS:
        if filtered:
            _one_by_one(frame, left, top, 2 * half + 1, motion, tools[6][0])
            return WARPED
        return LOST
    _fetch(frame, filtered, left + low_x, top + low_y, 2 * half + 1, tools)
    for dy in range(many_y):
        for dx in range(many_x):
            _interpolate(tools[7][0], dx, dy, 2 * half + 1 + _SPARE, tools[5], tools[6][1])
            _keep(whole, low_x + dx, low_y + dy, tools[6][1], tools[6][0])
    return WARPED


@njit(cache=True, nogil=True)
def _is_gentle(c: F64, half: int) -> bool:
    reach = 0.0
    for a in range(2):
        reach = max(reach, half * (abs(c[a, 1]) + abs(c[a, 2])))
        if c.shape[1] > 3:
            reach += half * half * (abs(c[a, 3]) + abs(c[a, 4]) + abs(c[a, 5]))
    return reach < _GENTLE


@njit(cache=True, nogil=True)
def _shift(
    frame: AnyArray,
    filtered: bool,
    left: int,
    top: int,
    u: float,
    v: float,
    side: int,
    tools: Tools,
) -> None:
    """Interpolate along one axis after the other: one fraction for the whole subset."""
    column, row = math.floor(u), math.floor(v)
    x, y = np.float32(u - column), np.float32(v - row)
    if filtered:
        _fetch(frame, filtered, left + column, top + row, side, tools)
        _shift_coefficients(tools[7][0], x, y, side, tools[7][1], tools[6][0])
    else:
        corner, scratch = (left + column, top + row), (tools[12], tools[13], tools[14])
        out = tools[6][0].reshape(side, side + _SPARE)
        shift_block(frame, corner, (x, y), tools[11], scratch, out)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _shift_coefficients(
    block: F32, x: np.float32, y: np.float32, side: int, across: F32, out: F32
) -> None:
    a0, a1, a2, a3, a4, a5 = weights(x)
    for n in range(block.shape[0] - TAPS):
        across[n] = (
            a0 * block[n] + a1 * block[n + 1] + a2 * block[n + 2]
            + a3 * block[n + 3] + a4 * block[n + 4] + a5 * block[n + 5]
        )  # fmt: skip
    width = side + _SPARE
    b0, b1, b2, b3, b4, b5 = weights(y)
    r0, r1, r2 = across, across[width:], across[2 * width :]
    r3, r4, r5 = across[3 * width :], across[4 * width :], across[5 * width :]
    for n in range(out.shape[0]):
        out[n] = b0 * r0[n] + b1 * r1[n] + b2 * r2[n] + b3 * r3[n] + b4 * r4[n] + b5 * r5[n]


@njit(cache=True, nogil=True)
def _fetch(frame: AnyArray, filtered: bool, x: int, y: int, side: int, tools: Tools) -> None:
    """Copy the block of coefficients for the pixels from (x, y) on."""
    if filtered:
        read(frame, x - 2 + PAD, y - 2 + PAD, side + _SPARE, tools[7][0])
    else:
        read_part(frame, x - 2, y - 2, side + _SPARE, tools[8], tools[9], tools[10], tools[7][0])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _move(c: F64, xi: F32, eta: F32, out: F32) -> None:
    c0, c1, c2 = np.float32(c[0]), np.float32(c[1]), np.float32(c[2])
    for n in range(out.shape[0]):
        out[n] = c0 + c1 * xi[n] + c2 * eta[n]
    if c.shape[0] > 3:
        c3, c4, c5 = np.float32(c[3]), np.float32(c[4]), np.float32(c[5])
        for n in range(out.shape[0]):
            out[n] += c3 * xi[n] * xi[n] + c4 * xi[n] * eta[n] + c5 * eta[n] * eta[n]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _split(motion: F32, whole: I32, taps: F32) -> None:
    """Split a motion into its whole part and the weights of its fraction."""
    w0, w1, w2, w3, w4, w5 = taps[0], taps[1], taps[2], taps[3], taps[4], taps[5]
    for n in range(motion.shape[0]):
        floor = math.floor(motion[n])
        whole[n] = np.int32(floor)
        w0[n], w1[n], w2[n], w3[n], w4[n], w5[n] = weights(motion[n] - np.float32(floor))


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _range(motion: F32) -> tuple[int, int]:
    """Least whole part of a motion, and how many there are."""
    low, high = motion[0], motion[0]
    for n in range(motion.shape[0]):
        low, high = min(low, motion[n]), max(high, motion[n])
    first = math.floor(low)
    return first, math.floor(high) - first + 1


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _interpolate(block: F32, dx: int, dy: int, width: int, taps: F32, out: F32) -> None:
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
def _keep(whole: I32, x: int, y: int, value: F32, out: F32) -> None:
    """Take the value where the whole part of the motion is (x, y)."""
    columns, rows = whole[0], whole[1]
    for n in range(out.shape[0]):
        out[n] = value[n] if columns[n] == x and rows[n] == y else out[n]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _one_by_one(spline: F32, left: int, top: int, side: int, motion: F32, out: F32) -> None:
    width = side + _SPARE
    for n in range(out.shape[0]):
        row, column = n // width, min(n % width, side - 1)
        out[n] = sample(spline, left + column + motion[0, n], top + row + motion[1, n])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def correlate_with(pixels: F32, tools: Tools, sums: F64) -> float:
    """Sum Jᵀg into `sums`: fx·m, fy·m, then -f and -1 as in `normal`; and return Σg²."""
    g, f, weight, jacobian = tools[6][0], pixels[2], pixels[3], tools[2]
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


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def subtract_fit(pixels: F32, step: F64, gain: float, tools: Tools, r: F32) -> float:
    """Write what the `step` (K,) of a fit leaves over, (pixels,), and return its sum of squares."""
    g, f, weight, jacobian = tools[6][0], pixels[2], pixels[3], tools[2]
    count, brighter = jacobian.shape[0], np.float32(1 / gain)
    contrast, offset = np.float32(step[count]), np.float32(step[count + 1])
    for n in range(r.shape[0]):
        r[n] = (g[n] * brighter - offset) * weight[n] - contrast * f[n]
    for k in range(count):
        row, change = jacobian[k], np.float32(step[k])
        for n in range(r.shape[0]):
            r[n] += change * row[n]
    total = np.float32(0)
    for n in range(r.shape[0]):
        total += r[n] * r[n]
    return float(total)

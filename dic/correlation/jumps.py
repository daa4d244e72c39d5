"""Jumps within subsets: two motions on the two sides of a line, in what one motion leaves over."""

from __future__ import annotations

import math
from functools import cache
from typing import TypeAlias

import numpy as np

from dic.arrays import F32, F64, I64
from dic.compiled import njit
from dic.correlation.deformed_image import DeformedImage
from dic.correlation.newton import Image, Known, Points, bench_tools, normal_of
from dic.correlation.reference import Reference
from dic.correlation.residuals import leave_over, textures_of
from dic.correlation.subset import Tools, offsets
from dic.fields import shape
from dic.per_thread import PerThread

Scratch: TypeAlias = tuple[F64, F64, F64, F64, F64]
"""Sums along a row, beyond each line, over all; terms of a curve, and what is fitted anyway."""

REACH = 0.6
"""Of half a subset: the lines along which it may break lie so far from its middle at most."""

_PLACES = tuple(REACH * k / 4 for k in range(-4, 5))
_NORMALS = tuple((math.cos(k * math.pi / 8), math.sin(k * math.pi / 8)) for k in range(8))
_DIRECTIONS, _LINES = len(_NORMALS), len(_PLACES)
_TOGETHER = 64  # points whose textures lie side by side: more would not stay in the cache
SIDE = 0.1  # fraction of Σ∇f² that must lie on each side of a break


def jumps(ref: Reference, points: Points, frame: DeformedImage, here: I64, smallest: float) -> F64:
    """Fit a jump along the best of 72 lines to what subsets leave over.

    Parameters
    ----------
    here : (M,) int64
        The points whose subsets are looked at.
    smallest : float, px
        A smaller jump is compared with no curve.

    Returns
    -------
    (M, 7) float64
        χ² of the jump, and of a curve of one order more than the shape function in a light that
        varies; the jump (u, v), px; and the line: its normal (x, y), towards the side that has
        jumped, and its distance from the point along it, px. NaN where a subset was lost; χ² of
        the curve also where the jump is smaller than `smallest`.
    """
    out = np.full((len(here), 7), np.nan)
    shapes = sides(ref.half), _curved(ref.half, ref.order + 1)
    scratch = _SCRATCH(ref.half, ref.order)
    for first in range(0, len(here), _TOGETHER):
        some = here[first : first + _TOGETHER]
        _fit_jumps(
            textures_of(ref, some), (frame.pixels, frame.filtered), some, (ref.xy, points.motion),
            normal_of(ref), (bench_tools(ref), scratch), shapes, smallest, out[first:],
        )  # fmt: skip
    return out


def _make_scratch(half: int, order: int) -> Scratch:
    size, (monomials, pixels) = 2 * shape.count(order) + 2, _curved(half, order + 1).shape
    numbers = 5 + 2 * size
    return (
        np.zeros((2 * half + 2, numbers)),
        np.empty((_DIRECTIONS, _LINES, numbers)),
        np.empty(numbers),
        np.empty((2 * monomials, pixels)),
        np.empty((size, pixels)),
    )


_SCRATCH = PerThread(_make_scratch)


@cache
def sides(half: int) -> I64:
    """Columns of each row that lie beyond each line, (directions, lines, rows, first and end)."""
    y, x = np.mgrid[-half : half + 1, -half : half + 1] / half
    ranges = np.zeros((_DIRECTIONS, _LINES, 2 * half + 1, 2), dtype=np.int64)
    for direction, (across, down) in enumerate(_NORMALS):
        for line, place in enumerate(_PLACES):
            # Pixels on a line belong to its outer side.
            edge = place + (1e-9 if place < 0 else -1e-9)
            count = np.count_nonzero(across * x + down * y > edge, axis=1)
            # Along a row they are the last columns, or the first where the normal points back.
            forward = across > -1e-9
            ranges[direction, line, :, 0] = 2 * half + 1 - count if forward else 0
            ranges[direction, line, :, 1] = 2 * half + 1 if forward else count
    return ranges


@cache
def _curved(half: int, degree: int) -> F64:
    """Monomials of a degree at the pixels of a subset, and x and y, (degree + 3, pixels)."""
    x, y = offsets(half).astype(np.float64) / half
    return np.stack([*(x**k * y ** (degree - k) for k in range(degree + 1)), x, y])


@njit(cache=True, nogil=True, error_model="numpy")
def _fit_jumps(
    textures: tuple[F32, I64],
    image: Image,
    here: I64,
    places: tuple[F64, F64],
    known: Known,
    scratch: tuple[Tools, Scratch],
    shapes: tuple[I64, F64],
    smallest: float,
    out: F64,
) -> None:
    (ranges, monomials), (tools, (sums, beyond, whole, terms, others)) = shapes, scratch
    (subsets, which), (xy, motion), (inverse, lights, half) = textures, places, known
    size = inverse.shape[1]
    unknowns, r = (np.empty(size), np.empty(size)), np.empty(subsets.shape[2], np.float32)
    for m in range(here.shape[0]):
        n, pixels = here[m], subsets[which[m]]
        total = leave_over(
            pixels, image, xy[n], motion[n], (inverse[n], lights[n], half), tools, unknowns, r
        )
        if total <= 0:
            continue
        _sum_beyond(pixels, r, tools[2], ranges, sums, beyond, whole)
        best = 0.0
        for direction in range(_DIRECTIONS):
            for line in range(_LINES):
                chi, u, v = _jump(beyond[direction, line], whole, inverse[n])
                if chi > best:
                    best = chi
                    out[m, 2], out[m, 3] = u, v
                    out[m, 4], out[m, 5] = _NORMALS[direction]
                    out[m, 6] = _PLACES[line] * half
        left = max(total - best, 1e-6 * total) / max(lights[n, 2] - size - 2, 1.0)
        out[m, 0] = best / left
        if best > 0 and math.hypot(out[m, 2], out[m, 3]) > smallest:
            found = _curve(pixels, r, inverse[n], tools[2], monomials, terms, others)
            out[m, 1] = found / left


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _sum_beyond(
    pixels: F32, r: F32, jacobian: F32, ranges: I64, sums: F64, beyond: F64, whole: F64
) -> None:
    """Sum ∇f r, ∇f∇fᵀ and ∇f Jᵀ over what lies beyond each line, and over the whole subset.

    `sums` (columns + 1, T) is scratch whose first row is 0: running sums along a row of pixels.
    """
    columns, size = sums.shape[0] - 1, (sums.shape[1] - 5) // 2
    width = r.shape[0] // ranges.shape[2]
    beyond[:], whole[:] = 0.0, 0.0
    for row in range(ranges.shape[2]):
        for column in range(columns):
            n = row * width + column
            _add_pixel(pixels, float(r[n]), jacobian, n, size, sums[column], sums[column + 1])
        for direction in range(_DIRECTIONS):
            for line in range(_LINES):
                first, end = ranges[direction, line, row]
                if first < end:
                    into, low, high = beyond[direction, line], sums[first], sums[end]
                    for t in range(into.shape[0]):
                        into[t] += high[t] - low[t]
        for t in range(whole.shape[0]):
            whole[t] += sums[columns, t]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _add_pixel(
    pixels: F32, r: float, jacobian: F32, n: int, size: int, before: F64, after: F64
) -> None:
    """Add the terms of a pixel to running sums."""
    fx, fy, f = pixels[0, n], pixels[1, n], pixels[2, n]
    after[0] = before[0] + fx * r
    after[1] = before[1] + fy * r
    after[2] = before[2] + fx * fx
    after[3] = before[3] + fx * fy
    after[4] = before[4] + fy * fy
    for k in range(size - 2):
        after[5 + k] = before[5 + k] + fx * jacobian[k, n]
        after[5 + size + k] = before[5 + size + k] + fy * jacobian[k, n]
    after[3 + size] = before[3 + size] - fx * f
    after[4 + size] = before[4 + size] - fx
    after[3 + 2 * size] = before[3 + 2 * size] - fy * f
    after[4 + 2 * size] = before[4 + 2 * size] - fy


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _jump(s: F64, whole: F64, inverse: F64) -> tuple[float, float, float]:
    """χ² (grey levels²) and size (u, v), px, of a jump of what lies beyond a line, from sums."""
    size, all_of_it = inverse.shape[0], whole[2] + whole[4]
    if min(s[2] + s[4], all_of_it - s[2] - s[4]) < SIDE * all_of_it:
        return 0.0, 0.0, 0.0
    xx, xy, yy = s[2], s[3], s[4]
    for i in range(size):
        x = y = 0.0
        for k in range(size):
            x += inverse[i, k] * s[5 + k]
            y += inverse[i, k] * s[5 + size + k]
        xx -= s[5 + i] * x
        xy -= s[5 + i] * y
        yy -= s[5 + size + i] * y
    determinant = xx * yy - xy * xy
    if xx <= 0 or yy <= 0 or determinant <= 1e-3 * xx * yy:
        return 0.0, 0.0, 0.0
    u, v = (yy * s[0] - xy * s[1]) / determinant, (xx * s[1] - xy * s[0]) / determinant
    return u * s[0] + v * s[1], -u, -v  # g - f is -∇f · the motion


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _curve(
    pixels: F32, r: F32, inverse: F64, jacobian: F32, monomials: F64, terms: F64, others: F64
) -> float:
    """χ² (grey levels²) of all terms of a degree in u and in v, and of light that varies.

    `terms` and `others`, the unknowns that are fitted anyway, (·, pixels) are scratch.
    """
    size, curved = inverse.shape[0], monomials.shape[0] - 2
    fx, fy, f, weight = pixels
    for n in range(r.shape[0]):
        for k in range(curved):
            terms[2 * k, n], terms[2 * k + 1, n] = monomials[k, n] * fx[n], monomials[k, n] * fy[n]
        for k in range(2):
            along = monomials[curved + k, n]
            terms[2 * curved + k, n] = along * f[n]
            terms[2 * curved + 2 + k, n] = along * weight[n]
        for k in range(size - 2):
            others[k, n] = jacobian[k, n]
        others[size - 2, n], others[size - 1, n] = -f[n], -weight[n]
    across, left = terms @ others.T, r.astype(np.float64)
    normal, more = terms @ terms.T, terms @ left
    for k in range(normal.shape[0]):
        normal[k, k] += 1e-6 * normal[k, k] + 1e-12
    normal -= across @ inverse @ across.T
    return float(more @ np.linalg.solve(normal, more))

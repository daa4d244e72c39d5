"""Sums over the subsets of the reference, taken once: what the normal equations are made of.

Here and in `frame_moments` a grid is summed by running sums and scattered points one by one.
"""

from __future__ import annotations

import numpy as np

from dic.arrays import F32, F64, I64
from dic.compiled import njit
from dic.correlation.window import SumPlan, add_row, along, close, open_windows, plan, raise_powers
from dic.fields import shape

_TERMS = 10


def reference_plan(order: int) -> SumPlan:
    """Sum fx², fxfy, fy² with monomials of twice the degree; fx f, fy f, fx, fy; f², f, n."""
    degree = shape.degree(order)
    return plan([2 * degree] * 3 + [degree] * 4 + [0] * 3)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _fill_terms(texture: F32, y: int, x: int, terms: F32) -> None:
    """Write the terms (10, n) of the pixels of a row, from column `x` on."""
    n = terms.shape[1]
    fx, fy = texture[0, y, x : x + n], texture[1, y, x : x + n]
    f, weight = texture[2, y, x : x + n], texture[3, y, x : x + n]
    for i in range(n):
        terms[0, i], terms[1, i], terms[2, i] = fx[i] * fx[i], fx[i] * fy[i], fy[i] * fy[i]
    for i in range(n):
        terms[3, i], terms[4, i], terms[5, i], terms[6, i] = (
            fx[i] * f[i],
            fy[i] * f[i],
            fx[i],
            fy[i],
        )
    for i in range(n):
        terms[7, i], terms[8, i], terms[9, i] = f[i] * f[i], f[i], weight[i]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _grid(texture: F32, xs: I64, ys: I64, half: int, columns: I64, sums: I64, out: F64) -> None:
    left, side = max(xs[0] - half, 0), 2 * half + 1
    width = min(xs[-1] + half + 1, texture.shape[2]) - left
    middle = 0.5 * (ys[0] + ys[-1])
    terms = np.empty((_TERMS, width), np.float32)
    total = np.zeros((columns.shape[0], width))
    ring = open_windows(ys, side)
    opened = np.empty((ring, columns.shape[0], width))
    window = np.empty_like(total)
    powers = np.empty((sums[:, 1].max() + 1, side))
    raise_powers(float(half), powers)
    first, last = 0, 0
    for y in range(ys[0] - half, ys[-1] + half + 1):
        while first < ys.shape[0] and ys[first] - half == y:
            opened[first % ring] = total
            first += 1
        if 0 <= y < texture.shape[1]:
            _fill_terms(texture, y, left, terms)
            add_row(terms, y - middle, columns, total)
        while last < ys.shape[0] and ys[last] + half == y:
            close(total, opened[last % ring], ys[last] - middle, columns, window)
            for c in range(xs.shape[0]):
                along(window, xs[c] - half - left, powers, sums, out[last, c])
            last += 1


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _points(texture: F32, xy: F64, half: int, columns: I64, sums: I64, out: F64) -> None:
    powers = np.empty((sums[:, 1].max() + 1, 2 * half + 1))
    for n in range(xy.shape[0]):
        x, y = round(xy[n, 0]), round(xy[n, 1])
        left, right = max(x - half, 0), min(x + half + 1, texture.shape[2])
        terms = np.empty((_TERMS, right - left), np.float32)
        total = np.zeros((columns.shape[0], right - left))
        for row in range(max(y - half, 0), min(y + half + 1, texture.shape[1])):
            _fill_terms(texture, row, left, terms)
            add_row(terms, row - xy[n, 1], columns, total)
        raise_powers(half + xy[n, 0] - x, powers)
        along(total, x - half - left, powers, sums, out[n])


def sums_on_grid(texture: F32, xs: I64, ys: I64, half: int, order: int) -> F64:
    """Sum under each subset of a grid, (R·C, S) float64, in the order of `reference_plan`.

    Parameters
    ----------
    texture : (4, H, W) float32
        fx, fy, f and weight (0 or 1) of each pixel, the first three zero where the weight is.
    xs : (C,) int, px
    ys : (R,) int, px
    half : int, px
        (subset - 1) / 2.
    """
    columns, sums = reference_plan(order)
    out = np.empty((len(ys), len(xs), len(sums)))
    _grid(texture, xs, ys, half, columns, sums, out)
    return out.reshape(-1, len(sums))


def sums_at_points(texture: F32, xy: F64, half: int, order: int) -> F64:
    """Sum around each of the points `xy` (N, 2) px: (N, S) float64."""
    columns, sums = reference_plan(order)
    out = np.empty((len(xy), len(sums)))
    _points(texture, xy, half, columns, sums, out)
    return out

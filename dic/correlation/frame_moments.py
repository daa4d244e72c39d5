"""Sums over subsets of a frame that is warped by the motion found so far.

The terms pair the texture of the reference with g(x + U) and with q = ∇f·(U - base), where `base`
is a whole number of px that takes the large part of the motion, so that single precision holds the
rest. What is solved for from these sums is the motion less the base.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from dic.arrays import F32, F64, I64
from dic.compiled import njit
from dic.correlation.dense_motion import MotionGrid
from dic.correlation.window import SumPlan, add_row, along, close, open_windows, plan, raise_powers
from dic.fields import shape
from dic.images.warp import TAPS, warp_row

Windows: TypeAlias = tuple[I64, I64, int]  # columns, rows and half side of the subsets

_TERMS = 11


def frame_plan(order: int) -> SumPlan:
    """Sum fx g, fy g, fx q, fy q with the monomials; f g, g, f q, q, g², g q, q²."""
    return plan([shape.degree(order)] * 4 + [0] * 7)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _fill_terms(texture: F32, y: int, x: int, u: F32, v: F32, g: F32, terms: F32) -> None:
    """Write the terms (11, n) of the pixels of a row; those without weight have g = q = 0."""
    n = terms.shape[1]
    fx, fy = texture[0, y, x : x + n], texture[1, y, x : x + n]
    f, weight = texture[2, y, x : x + n], texture[3, y, x : x + n]
    weighted, q = terms[5], terms[7]
    for i in range(n):
        weighted[i] = weight[i] * g[i]
        q[i] = fx[i] * u[i] + fy[i] * v[i]
    for i in range(n):
        terms[0, i], terms[1, i] = fx[i] * weighted[i], fy[i] * weighted[i]
        terms[2, i], terms[3, i] = fx[i] * q[i], fy[i] * q[i]
    for i in range(n):
        terms[4, i], terms[6, i] = f[i] * weighted[i], f[i] * q[i]
        terms[8, i], terms[9, i] = weighted[i] * weighted[i], weighted[i] * q[i]
        terms[10, i] = q[i] * q[i]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _spread(nodes: F64, weights: F64, line: int, motion: F32) -> None:
    """Interpolate a row between the nodes (2, R', C'): cubic down at `line`, then along x."""
    i, step = line // weights.shape[0] - 1, weights.shape[0]
    down = weights[line % step]
    across = np.empty(nodes.shape[2])
    for a in range(2):
        for j in range(nodes.shape[2]):
            across[j] = (
                down[0] * nodes[a, i, j] + down[1] * nodes[a, i + 1, j]
                + down[2] * nodes[a, i + 2, j] + down[3] * nodes[a, i + 3, j]
            )  # fmt: skip
        for phase in range(step):
            w0, w1, w2, w3 = weights[phase]
            for j in range(nodes.shape[2] - 3):
                motion[a, (j + 1) * step + phase] = np.float32(
                    w0 * across[j] + w1 * across[j + 1] + w2 * across[j + 2] + w3 * across[j + 3]
                )


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _grid(
    texture: F32,
    spline: F32,
    net: tuple[F64, F64, tuple[int, int]],
    base: tuple[int, int],
    windows: Windows,
    columns: I64,
    sums: I64,
    out: F64,
) -> None:
    nodes, weights, origin = net
    xs, ys, half = windows
    left, side = max(xs[0] - half, 0), 2 * half + 1
    width = min(xs[-1] + half + 1, texture.shape[2]) - left
    middle = 0.5 * (ys[0] + ys[-1])
    spread = np.empty((2, nodes.shape[2] * weights.shape[0]), np.float32)
    u = spread[0, left - origin[0] : left - origin[0] + width]
    v = spread[1, left - origin[0] : left - origin[0] + width]
    cells, taps = np.empty((2, width), np.int32), np.empty((2, TAPS, width), np.float32)
    g, terms = np.empty(width, np.float32), np.empty((_TERMS, width), np.float32)
    total, window = np.zeros((columns.shape[0], width)), np.empty((columns.shape[0], width))
    opened = np.empty((open_windows(ys, side), columns.shape[0], width))
    powers = np.empty((sums[:, 1].max() + 1, side))
    raise_powers(float(half), powers)
    first, last = 0, 0
    for y in range(ys[0] - half, ys[-1] + half + 1):
        while first < ys.shape[0] and ys[first] - half == y:
            opened[first % opened.shape[0]] = total
            first += 1
        if 0 <= y < texture.shape[1]:
            _spread(nodes, weights, y - origin[1], spread)
            warp_row(spline, (left + base[0], y + base[1]), u, v, cells, taps, g)
            _fill_terms(texture, y, left, u, v, g, terms)
            add_row(terms, y - middle, columns, total)
        while last < ys.shape[0] and ys[last] + half == y:
            close(total, opened[last % opened.shape[0]], ys[last] - middle, columns, window)
            for c in range(xs.shape[0]):
                along(window, xs[c] - half - left, powers, sums, out[last, c])
            last += 1


def sums_on_grid(
    texture: F32, spline: F32, net: MotionGrid, windows: Windows, order: int, out: F64
) -> None:
    """Sum under each subset of a grid, the frame warped by the dense motion `net`.

    Parameters
    ----------
    texture : (4, H, W) float32
    spline : (H + 2 PAD, W + 2 PAD) float32
        Coefficients of the frame.
    net : dic.correlation.dense_motion.MotionGrid
        Motion at the POIs and around them, px.
    windows : (xs, ys, half)
        As for the reference.
    out : (R, C, S) float64
        Written, in the order of `frame_plan`.
    """
    columns, sums = frame_plan(order)
    layout = net.motion, net.weights(), net.origin
    _grid(texture, spline, layout, net.base, windows, columns, sums, out)

"""Sums over subsets, by running sums on a grid and one by one at scattered points.

A pixel contributes a row of terms; a row of pixels is summed under each subset and *lifted* by powers
of y; rows are summed under each subset. On a grid both sums are differences of running sums, so the
cost does not depend on the size of the subset. x and y are those of the picture.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from dic.spline import sample

# Terms of a pixel of the reference: the products of (fx, fy, f, 1) and their moments along x.
_REFERENCE_TERMS = 20
# (term, power of y) appended to the sums, in this order.
_REFERENCE_LIFT = np.array(
    [(k, 1) for k in range(7)] + [(k, 1) for k in range(7, 10)] + [(k, 2) for k in range(3)]
)
_FRAME_TERMS = 15
_NOTHING = (0.0,) * _FRAME_TERMS
_FRAME_LIFT = np.array([(k, 1) for k in range(4)])
FRAME_SUMS = _FRAME_TERMS + len(_FRAME_LIFT)
REFERENCE_SUMS = _REFERENCE_TERMS + len(_REFERENCE_LIFT)


@njit(cache=True, nogil=True, fastmath=True, inline="always")
def _add_reference_terms(pixel, x, total):
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


@njit(cache=True, nogil=True, fastmath=True, inline="always")
def _with_frame_terms(total, pixel, x, g, q):
    """Add (fx g, fy g, fx q, fy q) · 1, x; f g, g, f q, q, g², g q, q² to a tuple, q = ∇f·U.

    A tuple stays in registers where an array would not: five times faster.
    """
    fx, fy, f = np.float64(pixel[0]), np.float64(pixel[1]), np.float64(pixel[2])
    x_g, y_g, x_q, y_q = fx * g, fy * g, fx * q, fy * q
    return (
        total[0] + x_g,
        total[1] + y_g,
        total[2] + x_q,
        total[3] + y_q,
        total[4] + x * x_g,
        total[5] + x * y_g,
        total[6] + x * x_q,
        total[7] + x * y_q,
        total[8] + f * g,
        total[9] + g,
        total[10] + f * q,
        total[11] + q,
        total[12] + g * g,
        total[13] + g * q,
        total[14] + q * q,
    )


@njit(cache=True, nogil=True, fastmath=True)
def _add_row(running, y, xs, half, lift, total):
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
def _reference_grid(texture, xs, ys, half, lift, out):
    running = np.zeros((texture.shape[1] + 1, _REFERENCE_TERMS))
    total = np.zeros(out.shape[1:])
    opened, closed = 0, 0
    for y in range(ys[0] - half, ys[-1] + half + 1):
        while opened < ys.shape[0] and ys[opened] - half == y:
            out[opened] = -total
            opened += 1
        for x in range(texture.shape[1]):
            running[x + 1] = running[x]
            _add_reference_terms(texture[y, x], float(x), running[x + 1])
        _add_row(running, float(y), xs, half, lift, total)
        while closed < ys.shape[0] and ys[closed] + half == y:
            out[closed] += total
            closed += 1


@njit(cache=True, nogil=True, fastmath=True)
def _reference_points(texture, centres, half, lift, out):
    row = np.empty(_REFERENCE_TERMS)
    for n in range(centres.shape[0]):
        for y in range(centres[n, 1] - half, centres[n, 1] + half + 1):
            row[:] = 0
            for x in range(centres[n, 0] - half, centres[n, 0] + half + 1):
                _add_reference_terms(texture[y, x], float(x), row)
            _lift_row(row, float(y), lift, out[n])


@njit(cache=True, nogil=True, fastmath=True)
def _lift_row(row, y, lift, total):
    for k in range(row.shape[0]):
        total[k] += row[k]
    for k in range(lift.shape[0]):
        factor = y if lift[k, 1] == 1 else y * y
        total[row.shape[0] + k] += factor * row[lift[k, 0]]


def reference_sums_on_grid(texture, xs, ys, half) -> NDArray[np.float64]:
    """Sums of the reference under each subset of a grid, (R·C, REFERENCE_SUMS).

    Parameters
    ----------
    texture : (H, W, 4) float32
        fx, fy, f and weight (0 or 1) of each pixel, the first three zero where the weight is.
    xs : (C,) int, px
    ys : (R,) int, px
    half : int, px
        (subset - 1) / 2.
    """
    out = np.empty((len(ys), len(xs), REFERENCE_SUMS))
    _reference_grid(texture, xs, ys, half, _REFERENCE_LIFT, out)
    return out.reshape(-1, REFERENCE_SUMS)


def reference_sums_at_points(texture, centres, half) -> NDArray[np.float64]:
    """The same around each of `centres` (N, 2) int, px: (N, REFERENCE_SUMS)."""
    out = np.zeros((len(centres), REFERENCE_SUMS))
    _reference_points(texture, centres, half, _REFERENCE_LIFT, out)
    return out


@njit(cache=True, nogil=True, fastmath=True)
def _warp_row(texture, spline, y, motion, place, warped):
    """Write g(x + U) and ∇f·U of one row; `place` (cell, 4 weights) interpolates `motion` (2, C')."""
    cells, weights = place
    for x in range(texture.shape[1]):
        pixel, j = texture[y, x], cells[x]
        if pixel[3] == 0 or j < 0:
            warped[x, :] = 0
            continue
        w0, w1, w2, w3 = weights[x, 0], weights[x, 1], weights[x, 2], weights[x, 3]
        u, v = motion[0, j : j + 4], motion[1, j : j + 4]
        du = w0 * u[0] + w1 * u[1] + w2 * u[2] + w3 * u[3]
        dv = w0 * v[0] + w1 * v[1] + w2 * v[2] + w3 * v[3]
        warped[x, 0] = sample(spline, x + du, y + dv)
        warped[x, 1] = pixel[0] * du + pixel[1] * dv


@njit(cache=True, nogil=True, fastmath=True)
def _run_along(pixels, warped, running):
    """Running sums (W + 1, k) of the terms of one row."""
    total = _NOTHING
    for x in range(pixels.shape[0]):
        total = _with_frame_terms(total, pixels[x], float(x), warped[x, 0], warped[x, 1])
        _store(total, running[x + 1])


@njit(cache=True, nogil=True, fastmath=True, inline="always")
def _store(total, out):
    for k in range(_FRAME_TERMS):
        out[k] = total[k]


@njit(cache=True, nogil=True, fastmath=True)
def _frame_grid(texture, spline, net, place_x, place_y, windows, out):
    xs, ys, half, lift = windows
    rows, weights = place_y
    running = np.zeros((texture.shape[1] + 1, _FRAME_TERMS))
    total = np.zeros(out.shape[1:])
    motion, warped = np.empty((2, net.shape[2])), np.empty((texture.shape[1], 2))
    opened, closed = 0, 0
    for y in range(ys[0] - half, ys[-1] + half + 1):
        while opened < ys.shape[0] and ys[opened] - half == y:
            out[opened] = -total
            opened += 1
        i = rows[y]
        for a in range(2):
            for j in range(net.shape[2]):
                motion[a, j] = (
                    weights[y, 0] * net[a, i, j]
                    + weights[y, 1] * net[a, i + 1, j]
                    + weights[y, 2] * net[a, i + 2, j]
                    + weights[y, 3] * net[a, i + 3, j]
                )
        _warp_row(texture, spline, y, motion, place_x, warped)
        _run_along(texture[y], warped, running)
        _add_row(running, float(y), xs, half, lift, total)
        while closed < ys.shape[0] and ys[closed] + half == y:
            out[closed] += total
            closed += 1


@njit(cache=True, nogil=True, fastmath=True)
def _frame_points(texture, spline, xy, half, motion, lift, out):
    row = np.empty(_FRAME_TERMS)
    for n in range(xy.shape[0]):
        u, ux, uy, v, vx, vy = motion[n]
        column, line = int(round(xy[n, 0])), int(round(xy[n, 1]))
        for y in range(line - half, line + half + 1):
            total = _NOTHING
            eta = y - xy[n, 1]
            for x in range(column - half, column + half + 1):
                pixel = texture[y, x]
                if pixel[3] == 0:
                    continue
                xi = x - xy[n, 0]
                du = u + ux * xi + uy * eta
                dv = v + vx * xi + vy * eta
                g = np.float64(sample(spline, x + du, y + dv))
                q = pixel[0] * du + pixel[1] * dv
                total = _with_frame_terms(total, pixel, float(x), g, q)
            _store(total, row)
            _lift_row(row, float(y), lift, out[n])


def frame_sums_on_grid(texture, spline, net, xs, ys, half) -> NDArray[np.float64]:
    """Sums of a frame, warped by the dense motion `net`, under each subset of a grid.

    Parameters
    ----------
    texture : (H, W, 4) float32
    spline : float32
        Coefficients of the frame.
    net : dic.dense.Net
        Motion at the POIs and around them, px.
    xs, ys, half
        As for the reference.

    Returns
    -------
    (R·C, FRAME_SUMS) float64
    """
    out = np.empty((len(ys), len(xs), FRAME_SUMS))
    place_x, place_y = net.place(texture.shape[1], 0), net.place(texture.shape[0], 1)
    _frame_grid(texture, spline, net.motion, place_x, place_y, (xs, ys, half, _FRAME_LIFT), out)
    return out.reshape(-1, FRAME_SUMS)


def frame_sums_at_points(texture, spline, xy, half, motion) -> NDArray[np.float64]:
    """The same at scattered points `xy` (N, 2) px, each warped by its own `motion` (N, 6)."""
    out = np.zeros((len(xy), FRAME_SUMS))
    _frame_points(texture, spline, xy, half, motion, _FRAME_LIFT, out)
    return out

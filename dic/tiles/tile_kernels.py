"""Inner loops of the tile sums: compiled, without checks."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from scipy.interpolate import BSpline, PPoly

from dic.arrays import F32, F64, AnyArray
from dic.compiled import njit

DEGREE = 7  # of the B-spline
BEFORE = DEGREE // 2  # knots that a value needs before the pixel to its left
_SPLINE = PPoly.from_spline(BSpline.basis_element(np.arange(DEGREE + 2.0)).tck)
_PIECES: F64 = np.ascontiguousarray(_SPLINE.c[:, DEGREE : 2 * DEGREE + 1][:, ::-1])
"""[power from the highest, knot -3 … 4]: what a knot weighs at the fraction t, a polynomial."""
_SLOPES: F64 = _PIECES[:-1] * np.arange(DEGREE, 0, -1.0)[:, None]
# Indices that cannot be negative: any others keep the compiler from working on vectors.
_ONE, _TWO, _THREE, _FOUR, _FIVE, _SIX, _SEVEN = (np.uintp(k) for k in range(1, DEGREE + 1))


Weights: TypeAlias = tuple[
    np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32, np.float32
]
"""Of eight knots."""


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def sums_in_place(
    image: AnyArray,
    reference: F32,
    gradient: F32,
    layout: tuple[tuple[int, int], int, tuple[int, int]],
    out: AnyArray,
) -> None:
    """Sum fx·e, fy·e, e, e², e·f over every tile into `out` (T, 5), row by row of the image.

    `layout` is origin, size and shape of `Tiles`.
    """
    origin, size, (rows, columns) = layout
    columnwise = np.empty((5, size * columns), np.float32)
    wide = slice(origin[0], origin[0] + size * columns)
    for row in range(rows):
        columnwise[:] = 0.0
        for y in range(origin[1] + row * size, origin[1] + (row + 1) * size):
            _add_row(
                image[y, wide],
                reference[y, wide],
                gradient[0, y, wide],
                gradient[1, y, wide],
                columnwise,
            )
        for column in range(columns):
            for k in range(5):
                total = np.float32(0.0)
                for x in range(column * size, (column + 1) * size):
                    total += columnwise[k, x]
                out[row * columns + column, k] = total


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _add_row(image: AnyArray, f: F32, fx: F32, fy: F32, sums: F32) -> None:
    """Add fx·e, fy·e, e, e², e·f of each pixel of a row to `sums` (5, W).

    With every array a row of its own the compiler works on vectors, in a third of the time.
    """
    fx_e, fy_e, e_, ee, ef = sums[0], sums[1], sums[2], sums[3], sums[4]
    for x in range(f.size):
        e = np.float32(image[x]) - f[x]
        fx_e[x] += fx[x] * e
        fy_e[x] += fy[x] * e
        e_[x] += e
        ee[x] += e * e
        ef[x] += e * f[x]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def spline_weights(t: float, value: AnyArray, slope: AnyArray) -> None:
    """Weigh the knots -3 … 4 at the fraction t and their derivatives."""
    for k in range(DEGREE + 1):
        height, rise = _PIECES[0, k], _SLOPES[0, k]
        for power in range(1, DEGREE):
            height = height * t + _PIECES[power, k]
            rise = rise * t + _SLOPES[power, k]
        value[k] = height * t + _PIECES[DEGREE, k]
        slope[k] = rise


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def sums_moved(
    image: AnyArray,
    coefficients: F32,
    steep: F32 | None,
    motion: tuple[F64, F64],
    layout: tuple[tuple[int, int], int, tuple[int, int]],
    out: AnyArray,
    hessian: F64,
    light: F64,
) -> None:
    """Sum the same with every tile of the reference moved by its flow, and what it is then.

    That is its Hessian (T, 3) and its light (T, 6): beside the rim of the pattern a fraction of a
    pixel changes both many times. `motion` is the flow (T, 2) and its gradient (T, 2, 2), by
    which the reference is deformed to first order.

    Slopes are those of `steep`, the coefficients of a smoothed image, where there are such.

    What is computed of a tile lies in one piece of memory, a row after the other. Values and slopes
    are computed together: to read what they are made of takes as long as that.
    """
    (origin, size, shape), (flow, flow_gradient) = layout, motion
    reach = size + DEGREE
    places = _places(size)
    patch, pixels = np.empty((reach, reach), np.float32), size * size
    heights, g = np.empty(reach * size, np.float32), np.empty(pixels, np.float32)
    values, slopes = np.empty(reach * size, np.float32), np.empty(reach * size, np.float32)
    wx, sx = np.empty(DEGREE + 1, np.float32), np.empty(DEGREE + 1, np.float32)
    wy, sy = np.empty(DEGREE + 1, np.float32), np.empty(DEGREE + 1, np.float32)
    for tile in range(shape[0] * shape[1]):
        left = origin[0] + (tile % shape[1]) * size
        top = origin[1] + (tile // shape[1]) * size
        # f(x - d) lies in the pixel that starts at floor(-d).
        ix, iy = int(np.floor(-flow[tile, 0])), int(np.floor(-flow[tile, 1]))
        spline_weights(-flow[tile, 0] - ix, wx, sx)
        spline_weights(-flow[tile, 1] - iy, wy, sy)
        x, y = left + ix - BEFORE, top + iy - BEFORE
        _across(coefficients, x, y, wx, sx, patch, heights, slopes)
        across = heights
        if steep is not None:
            _across(steep, x, y, wx, sx, patch, values, slopes)
            across = values
        _seen(image, left, top, size, g)
        rows = heights, slopes, across
        deformed = flow_gradient[tile], places
        _down(g, rows, wy, sy, size, deformed, out[tile], hessian[tile], light[tile])


@njit(cache=True, nogil=True)
def _places(size: int) -> F32:
    """Place x, y of each pixel of a tile about its centre, (2, size²), row by row."""
    places = np.empty((2, size * size), np.float32)
    for k in range(size * size):
        places[0, k] = k % size - 0.5 * (size - 1)
        places[1, k] = k // size - 0.5 * (size - 1)
    return places


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _across(
    array: F32, left: int, top: int, wx: F32, sx: F32, patch: F32, values: F32, slopes: F32
) -> None:
    """Weigh the rows of a tile along x, also beyond the border; `patch` is for that."""
    (height, width), reach = array.shape, len(patch)
    if 0 <= left <= width - reach and 0 <= top <= height - reach:
        _along(array, left, top, wx, sx, reach - DEGREE, values, slopes)
    else:
        _cut(array, left, top, patch)
        _along(patch, 0, 0, wx, sx, reach - DEGREE, values, slopes)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _cut(array: F32, left: int, top: int, patch: F32) -> None:
    """Copy a patch; beyond the border the nearest value stands."""
    height, width = array.shape
    for j in range(len(patch)):
        y = min(max(top + j, 0), height - 1)
        for i in range(len(patch)):
            patch[j, i] = array[y, min(max(left + i, 0), width - 1)]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _seen(image: AnyArray, left: int, top: int, size: int, out: F32) -> None:
    """Copy a tile of the image, row by row."""
    x, y, side = np.uintp(left), np.uintp(top), np.uintp(size)
    for j in range(side):
        for i in range(side):
            out[j * side + i] = np.float32(image[y + j, x + i])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _eight(weights: F32) -> Weights:
    """Hold weights where no array of the loop can change them."""
    a, b, c, d = weights[0], weights[1], weights[2], weights[3]
    return a, b, c, d, weights[4], weights[5], weights[6], weights[7]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _weighed(row: F32, first: int | np.uintp, step: np.uintp, weights: Weights) -> np.float32:
    """Weigh eight neighbours from a place on, each so far from the next."""
    a, b, c, d, e, f, g, h = weights
    return (
        a * row[first] + b * row[first + step]
        + c * row[first + _TWO * step] + d * row[first + _THREE * step]
        + e * row[first + _FOUR * step] + f * row[first + _FIVE * step]
        + g * row[first + _SIX * step] + h * row[first + _SEVEN * step]
    )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _along(
    array: F32, left: int, top: int, wx: F32, sx: F32, size: int, values: F32, slopes: F32
) -> None:
    """Weigh eight neighbours along x; weights in registers let the loop run on vectors."""
    value, slope = _eight(wx), _eight(sx)
    x, y, side = np.uintp(left), np.uintp(top), np.uintp(size)
    for j in range(np.uintp(size + DEGREE)):
        row = array[y + j]
        for i in range(side):
            values[j * side + i] = _weighed(row, x + i, _ONE, value)
            slopes[j * side + i] = _weighed(row, x + i, _ONE, slope)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _down(
    g: F32,
    rows: tuple[F32, F32, F32],
    wy: F32,
    sy: F32,
    size: int,
    deformed: tuple[F64, F32],
    out: AnyArray,
    hessian: F64,
    light: F64,
) -> None:
    """Weigh eight neighbours along y, of rows for f, fx and fy, and sum over one tile.

    That is fx·e, fy·e, e, e², e·f into `out`; fx², fx·fy, fy²; and fx·f, fy·f, fx, fy, f², f.
    """
    (heights, slopes, across), value, slope = rows, _eight(wy), _eight(sy)
    gradient, places = deformed
    x, y = places[0], places[1]
    u_x, u_y = np.float32(gradient[0, 0]), np.float32(gradient[0, 1])
    v_x, v_y = np.float32(gradient[1, 0]), np.float32(gradient[1, 1])
    zero = np.float32(0.0)
    fx_e, fy_e, e_, ee, ef = zero, zero, zero, zero, zero
    xx, xy, yy = zero, zero, zero
    fx_f, fy_f, fx_, fy_, ff, f_ = zero, zero, zero, zero, zero, zero
    below = np.uintp(size)
    for i in range(below * below):
        f = _weighed(heights, i, below, value)
        fx, fy = _weighed(slopes, i, below, value), _weighed(across, i, below, slope)
        # f(x - d - δ) = f(x - d) - ∇f·δ where the motion differs by δ from that of the tile.
        e = g[i] - f + fx * (u_x * x[i] + u_y * y[i]) + fy * (v_x * x[i] + v_y * y[i])
        fx_e += fx * e
        fy_e += fy * e
        e_ += e
        ee += e * e
        ef += e * f
        xx += fx * fx
        xy += fx * fy
        yy += fy * fy
        fx_f += fx * f
        fy_f += fy * f
        fx_ += fx
        fy_ += fy
        ff += f * f
        f_ += f
    out[0], out[1], out[2], out[3], out[4] = fx_e, fy_e, e_, ee, ef
    hessian[0], hessian[1], hessian[2] = xx, xy, yy
    light[0], light[1], light[2], light[3], light[4], light[5] = fx_f, fy_f, fx_, fy_, ff, f_

"""Inner loops of the tile sums: compiled, without checks."""

from __future__ import annotations

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
    flow: F64,
    layout: tuple[tuple[int, int], int, tuple[int, int]],
    out: AnyArray,
    hessian: F64,
    light: F64,
) -> None:
    """Sum the same with every tile of the reference moved by its flow, and what it is then.

    That is its Hessian (T, 3) and its light (T, 6): beside the rim of the pattern a fraction of a
    pixel changes both many times.

    Slopes are those of `steep`, the coefficients of a smoothed image, where there are such.

    What is computed of a tile lies in one piece of memory, a row after the other.
    """
    origin, size, shape = layout
    reach = size + DEGREE
    patch, pixels = np.empty((reach, reach), np.float32), size * size
    values, slopes = np.empty(reach * size, np.float32), np.empty(reach * size, np.float32)
    g, f = np.empty(pixels, np.float32), np.empty(pixels, np.float32)
    fx, fy = np.empty(pixels, np.float32), np.empty(pixels, np.float32)
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
        _across(coefficients, x, y, wx, patch, values)
        _down(values, wy, size, f)
        if steep is None:
            _across(coefficients, x, y, sx, patch, slopes)
        else:
            _across(steep, x, y, wx, patch, values)
            _across(steep, x, y, sx, patch, slopes)
        _down(slopes, wy, size, fx)
        _down(values, sy, size, fy)
        _seen(image, left, top, size, g)
        _add(g, f, fx, fy, out[tile])
        _own(f, fx, fy, hessian[tile], light[tile])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _across(array: F32, left: int, top: int, weights: F32, patch: F32, out: F32) -> None:
    """Weigh the rows of a tile along x, also beyond the border; `patch` is for that."""
    (height, width), reach = array.shape, len(patch)
    if 0 <= left <= width - reach and 0 <= top <= height - reach:
        _along(array, left, top, weights, reach - DEGREE, out)
    else:
        _cut(array, left, top, patch)
        _along(patch, 0, 0, weights, reach - DEGREE, out)


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
def _along(array: F32, left: int, top: int, weights: F32, size: int, out: F32) -> None:
    """Weigh eight neighbours along x; weights in registers let the loop run on vectors."""
    a, b, c, d = weights[0], weights[1], weights[2], weights[3]
    e, f, g, h = weights[4], weights[5], weights[6], weights[7]
    x, y, side = np.uintp(left), np.uintp(top), np.uintp(size)
    for j in range(np.uintp(size + DEGREE)):
        for i in range(side):
            p, q = y + j, x + i
            out[j * side + i] = (
                a * array[p, q] + b * array[p, q + _ONE]
                + c * array[p, q + _TWO] + d * array[p, q + _THREE]
                + e * array[p, q + _FOUR] + f * array[p, q + _FIVE]
                + g * array[p, q + _SIX] + h * array[p, q + _SEVEN]
            )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _down(rows: F32, weights: F32, size: int, out: F32) -> None:
    """Weigh eight neighbours along y."""
    a, b, c, d = weights[0], weights[1], weights[2], weights[3]
    e, f, g, h = weights[4], weights[5], weights[6], weights[7]
    n = np.uintp(size)
    for i in range(n * n):
        out[i] = (
            a * rows[i] + b * rows[i + n] + c * rows[i + _TWO * n] + d * rows[i + _THREE * n]
            + e * rows[i + _FOUR * n] + f * rows[i + _FIVE * n]
            + g * rows[i + _SIX * n] + h * rows[i + _SEVEN * n]
        )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _add(g: F32, f: F32, fx: F32, fy: F32, out: AnyArray) -> None:
    """Sum fx·e, fy·e, e, e², e·f over one tile."""
    zero = np.float32(0.0)
    fx_e, fy_e, e_, ee, ef = zero, zero, zero, zero, zero
    for i in range(f.size):
        e = g[i] - f[i]
        fx_e += fx[i] * e
        fy_e += fy[i] * e
        e_ += e
        ee += e * e
        ef += e * f[i]
    out[0], out[1], out[2], out[3], out[4] = fx_e, fy_e, e_, ee, ef


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _own(f: F32, fx: F32, fy: F32, hessian: F64, light: F64) -> None:
    """Sum fx², fx·fy, fy² over one tile, and fx·f, fy·f, fx, fy, f², f."""
    zero = np.float32(0.0)
    xx, xy, yy = zero, zero, zero
    fx_f, fy_f, fx_, fy_, ff, f_ = zero, zero, zero, zero, zero, zero
    for i in range(f.size):
        xx += fx[i] * fx[i]
        xy += fx[i] * fy[i]
        yy += fy[i] * fy[i]
        fx_f += fx[i] * f[i]
        fy_f += fy[i] * f[i]
        fx_ += fx[i]
        fy_ += fy[i]
        ff += f[i] * f[i]
        f_ += f[i]
    hessian[0], hessian[1], hessian[2] = xx, xy, yy
    light[0], light[1], light[2], light[3], light[4], light[5] = fx_f, fy_f, fx_, fy_, ff, f_

"""Inner loops of the tile sums: compiled, without checks."""

from __future__ import annotations

import numpy as np

from dic.arrays import F32, F64, AnyArray
from dic.compiled import njit

DEGREE = 7  # of the B-spline
BEFORE = DEGREE // 2  # knots that a value needs before the pixel to its left


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def sums_in_place(
    image: AnyArray,
    reference: F32,
    gradient: F32,
    origin: tuple[int, int],
    size: int,
    shape: tuple[int, int],
    out: AnyArray,
) -> None:
    """Sum fx·e, fy·e, e, e², e·f over every tile into `out` (T, 5), row by row of the image."""
    rows, columns = shape
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
    """Weigh the knots -3 … 4 at the fraction t and their derivatives, by de Boor's recursion."""
    value[:] = 0.0
    value[0] = 1.0
    for degree in range(1, DEGREE + 1):
        if degree == DEGREE:
            slope[0] = -value[0]
            for j in range(1, DEGREE + 1):
                slope[j] = value[j - 1] - value[j]
        for j in range(degree, -1, -1):
            before = value[j - 1] if j else 0.0
            value[j] = ((t + degree - j) * before + (j + 1 - t) * value[j]) / degree


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def sums_moved(
    image: AnyArray,
    coefficients: F32,
    flow: F64,
    origin: tuple[int, int],
    size: int,
    shape: tuple[int, int],
    out: AnyArray,
    light: F64,
) -> None:
    """Sum the same with every tile of the reference moved by its flow, and its light (T, 6)."""
    reach = size + DEGREE
    patch = np.empty((reach, reach), np.float32)
    values, slopes = np.empty((reach, size), np.float32), np.empty((reach, size), np.float32)
    f = np.empty((size, size), np.float32)
    fx, fy = np.empty_like(f), np.empty_like(f)
    wx, sx = np.empty(DEGREE + 1, np.float32), np.empty(DEGREE + 1, np.float32)
    wy, sy = np.empty(DEGREE + 1, np.float32), np.empty(DEGREE + 1, np.float32)
    for tile in range(shape[0] * shape[1]):
        left = origin[0] + (tile % shape[1]) * size
        top = origin[1] + (tile // shape[1]) * size
        # f(x - d) lies in the pixel that starts at floor(-d).
        ix, iy = int(np.floor(-flow[tile, 0])), int(np.floor(-flow[tile, 1]))
        spline_weights(-flow[tile, 0] - ix, wx, sx)
        spline_weights(-flow[tile, 1] - iy, wy, sy)
        _cut(coefficients, left + ix - BEFORE, top + iy - BEFORE, patch)
        _along(patch, wx, values)
        _along(patch, sx, slopes)
        _down(values, wy, f)
        _down(slopes, wy, fx)
        _down(values, sy, fy)
        _add(image[top : top + size, left : left + size], f, fx, fy, out[tile])
        _add_light(f, fx, fy, light[tile])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _cut(array: F32, left: int, top: int, patch: F32) -> None:
    """Copy a patch; beyond the border the nearest value stands."""
    height, width = array.shape
    side = len(patch)
    for j in range(side):
        y = min(max(top + j, 0), height - 1)
        if left >= 0 and left + side <= width:
            row, cut = array[y, left : left + side], patch[j]
            for i in range(side):  # a loop, for copying a slice takes twice as long
                cut[i] = row[i]
        else:
            for i in range(side):
                patch[j, i] = array[y, min(max(left + i, 0), width - 1)]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _along(patch: F32, weights: F32, out: AnyArray) -> None:
    """Weigh eight neighbours along x; weights in registers let the loop run on vectors."""
    a, b, c, d = weights[0], weights[1], weights[2], weights[3]
    e, f, g, h = weights[4], weights[5], weights[6], weights[7]
    for j in range(out.shape[0]):
        p, row = patch[j], out[j]
        for i in range(row.size):
            row[i] = (
                a * p[i] + b * p[i + 1] + c * p[i + 2] + d * p[i + 3]
                + e * p[i + 4] + f * p[i + 5] + g * p[i + 6] + h * p[i + 7]
            )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _down(rows: F32, weights: F32, out: AnyArray) -> None:
    """Weigh eight neighbours along y."""
    a, b, c, d = weights[0], weights[1], weights[2], weights[3]
    e, f, g, h = weights[4], weights[5], weights[6], weights[7]
    for j in range(out.shape[0]):
        row, p, q, r, s = out[j], rows[j], rows[j + 1], rows[j + 2], rows[j + 3]
        t, u, v, w = rows[j + 4], rows[j + 5], rows[j + 6], rows[j + 7]
        for i in range(row.size):
            row[i] = (
                a * p[i] + b * q[i] + c * r[i] + d * s[i]
                + e * t[i] + f * u[i] + g * v[i] + h * w[i]
            )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _add(image: AnyArray, f: F32, fx: F32, fy: F32, out: AnyArray) -> None:
    """Sum fx·e, fy·e, e, e², e·f over one tile."""
    zero = np.float32(0.0)
    fx_e, fy_e, e_, ee, ef = zero, zero, zero, zero, zero
    for j in range(f.shape[0]):
        for i in range(f.shape[1]):
            e = np.float32(image[j, i]) - f[j, i]
            fx_e += fx[j, i] * e
            fy_e += fy[j, i] * e
            e_ += e
            ee += e * e
            ef += e * f[j, i]
    out[0], out[1], out[2], out[3], out[4] = fx_e, fy_e, e_, ee, ef


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _add_light(f: F32, fx: F32, fy: F32, out: AnyArray) -> None:
    """Sum fx·f, fy·f, fx, fy, f², f over one tile."""
    zero = np.float32(0.0)
    fx_f, fy_f, fx_, fy_, ff, f_ = zero, zero, zero, zero, zero, zero
    for j in range(f.shape[0]):
        for i in range(f.shape[1]):
            fx_f += fx[j, i] * f[j, i]
            fy_f += fy[j, i] * f[j, i]
            fx_ += fx[j, i]
            fy_ += fy[j, i]
            ff += f[j, i] * f[j, i]
            f_ += f[j, i]
    out[0], out[1], out[2], out[3], out[4], out[5] = fx_f, fy_f, fx_, fy_, ff, f_

"""Inner loops over the pixels of tiles: compiled, without checks."""

from __future__ import annotations

import math

import numpy as np

from dic.adaptive.tile_lattice import TILE
from dic.arrays import F32, F64
from dic.compiled import njit
from dic.images.warp import PAD, TAPS, sample, weights

_HALF = TILE // 2
_SIDE = TILE + TAPS - 1
_GENTLE = 0.03  # px by which a tile may deform and still be warped as if it did not
OF_REFERENCE, OF_FRAME = 10, 5  # sums of each tile


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def sum_reference(texture: F32, left: int, top: int, out: F64) -> None:
    """Sum fx², fx fy, fy², fx f, fy f, fx, fy, f², f, 1 over the tiles (R, C, 10)."""
    zero = np.float32(0.0)
    for r in range(out.shape[0]):
        for c in range(out.shape[1]):
            xx, xy, yy, fx_f, fy_f = zero, zero, zero, zero, zero
            sum_x, sum_y, ff, sum_f, count = zero, zero, zero, zero, zero
            for y in range(top + TILE * r - _HALF, top + TILE * r + _HALF + 1):
                for x in range(left + TILE * c - _HALF, left + TILE * c + _HALF + 1):
                    fx, fy, f = texture[0, y, x], texture[1, y, x], texture[2, y, x]
                    xx += fx * fx
                    xy += fx * fy
                    yy += fy * fy
                    fx_f += fx * f
                    fy_f += fy * f
                    sum_x += fx
                    sum_y += fy
                    ff += f * f
                    sum_f += f
                    count += texture[3, y, x]
            into = out[r, c]
            into[0], into[1], into[2], into[3], into[4] = xx, xy, yy, fx_f, fy_f
            into[5], into[6], into[7], into[8], into[9] = sum_x, sum_y, ff, sum_f, count


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def sum_frame(texture: F32, spline: F32, left: int, top: int, motion: F64, out: F64) -> None:
    """Sum fx g, fy g, g, g², f g over the tiles, each read where its motion takes it.

    `motion` (R, C, 2, 6) px holds the shift of the middle of each tile, its gradient, and its
    second derivatives along x, across and along y.
    """
    block = np.empty((_SIDE, TILE), np.float32)
    g = np.empty((TILE, TILE), np.float32)
    for r in range(out.shape[0]):
        for c in range(out.shape[1]):
            x, y, m = left + TILE * c, top + TILE * r, motion[r, c]
            bend = max(_bending(m[0]), _bending(m[1]))
            if bend < _GENTLE and _fits(spline, x + m[0, 0], y + m[1, 0]):
                _shift(spline, x, y, m, block, g)
                _bend(texture, x, y, m, g)
            else:
                _warp(spline, x, y, m, g)
            _add(texture, x - _HALF, y - _HALF, g, out[r, c])


@njit(cache=True, nogil=True)
def _bending(m: F64) -> float:
    """Largest motion of the corner of a tile against its middle, px."""
    curved = 0.5 * abs(m[3]) + abs(m[4]) + 0.5 * abs(m[5])
    return _HALF * (abs(m[1]) + abs(m[2]) + _HALF * curved)


@njit(cache=True, nogil=True)
def _fits(spline: F32, x: float, y: float) -> bool:
    """Whether the taps of a tile that moves to (x, y) lie on the image."""
    reach = _HALF + TAPS // 2
    height, width = spline.shape[0] - 2 * PAD, spline.shape[1] - 2 * PAD
    return x - reach > -PAD and y - reach > -PAD and x + reach < width and y + reach < height


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _shift(spline: F32, x: int, y: int, m: F64, block: F32, g: F32) -> None:
    """Interpolate along x and then along y: one fraction for the whole tile."""
    column, row = math.floor(m[0, 0]), math.floor(m[1, 0])
    a0, a1, a2, a3, a4, a5 = weights(np.float32(m[0, 0] - column))
    b0, b1, b2, b3, b4, b5 = weights(np.float32(m[1, 0] - row))
    i, j = y + row - _HALF + PAD - 2, x + column - _HALF + PAD - 2
    for k in range(_SIDE):
        line = spline[i + k]
        for n in range(TILE):
            p = j + n
            block[k, n] = (
                a0 * line[p] + a1 * line[p + 1] + a2 * line[p + 2]
                + a3 * line[p + 3] + a4 * line[p + 4] + a5 * line[p + 5]
            )  # fmt: skip
    for k in range(TILE):
        for n in range(TILE):
            g[k, n] = (
                b0 * block[k, n] + b1 * block[k + 1, n] + b2 * block[k + 2, n]
                + b3 * block[k + 3, n] + b4 * block[k + 4, n] + b5 * block[k + 5, n]
            )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _bend(texture: F32, x: int, y: int, m: F64, g: F32) -> None:
    """Add what a gentle motion bends, by ∇f: an error of second order."""
    u, v = m[0], m[1]
    for k in range(TILE):
        for n in range(TILE):
            xi, eta = n - _HALF, k - _HALF
            fx, fy = texture[0, y + eta, x + xi], texture[1, y + eta, x + xi]
            g[k, n] += np.float32(fx * _away(u, xi, eta) + fy * _away(v, xi, eta))


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def _away(m: F64, xi: int, eta: int) -> float:
    """Motion of a pixel of a tile against that of its middle, px."""
    return (m[1] + 0.5 * m[3] * xi + m[4] * eta) * xi + (m[2] + 0.5 * m[5] * eta) * eta


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _warp(spline: F32, x: int, y: int, m: F64, g: F32) -> None:
    for k in range(TILE):
        for n in range(TILE):
            xi, eta = n - _HALF, k - _HALF
            u, v = m[0, 0] + _away(m[0], xi, eta), m[1, 0] + _away(m[1], xi, eta)
            g[k, n] = sample(spline, x + xi + u, y + eta + v)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _add(texture: F32, x: int, y: int, g: F32, out: F64) -> None:
    zero = np.float32(0.0)
    fx_g, fy_g, sum_g, gg, fg = zero, zero, zero, zero, zero
    for k in range(TILE):
        for n in range(TILE):
            value = g[k, n] * texture[3, y + k, x + n]
            fx_g += texture[0, y + k, x + n] * value
            fy_g += texture[1, y + k, x + n] * value
            sum_g += value
            gg += value * value
            fg += texture[2, y + k, x + n] * value
    out[0], out[1], out[2], out[3], out[4] = fx_g, fy_g, sum_g, gg, fg

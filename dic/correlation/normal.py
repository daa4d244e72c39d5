"""The normal equations of the subsets: how each responds to motion and light.

H = Σ JᵀJ with J = (fx·m, fy·m, -f, -1): the monomials m of the shape function for u and for v, and
the gain and offset of the light.
"""

from __future__ import annotations

import numpy as np

from dic.arrays import F64, I8, I64, AnyArray, Mask
from dic.compiled import njit
from dic.fields import shape
from dic.fields.displacement import Status

_FLAT = 1e-3  # least slope of a subset over the steepest, below which nothing can be solved
_RIDGE = 1e-10  # of the diagonal: a degenerate pattern inverts, and its σ is huge as it should
_BLOCK = 64  # points inverted side by side, so that the loops over them run on vectors


def inverse(sums: AnyArray, status: AnyArray, order: int) -> F64:
    """Invert over the unknowns of the order, (N, K, K); zero for what is held at zero.

    Parameters
    ----------
    sums : (N, S) float64
        As from `dic.correlation.moments`.
    status : (N,) int8
        The inverse is that of nothing where it is not OK.
    """
    places, unknowns = _places(order), shape.unknowns(order)
    out = np.zeros((len(sums), len(places), len(places)))
    _invert(sums, status != Status.OK, places, unknowns, out)
    return out


def _places(order: int) -> I64:
    """Where each entry of H stands among the sums, (K, K): those of f and 1 with a minus sign."""
    count, table = shape.count(order), shape.products(order)
    squares = table.max() + 1
    of_light = 3 * squares + count * np.arange(4)[:, None] + np.arange(count)  # fx f, fy f, fx, fy
    alone = 3 * squares + 4 * count  # f², f, n
    places = np.empty((2 * count + 2, 2 * count + 2), dtype=np.int64)
    first, second = np.s_[:count], np.s_[count : 2 * count]
    places[first, first], places[second, second] = table, 2 * squares + table
    places[first, second] = places[second, first] = squares + table
    for column, (of_x, of_y) in ((-2, of_light[:2]), (-1, of_light[2:])):
        places[first, column] = places[column, first] = of_x
        places[second, column] = places[column, second] = of_y
    places[-2:, -2:] = alone + np.array([[0, 1], [1, 2]])
    return places


@njit(cache=True, nogil=True, error_model="numpy")
def _invert(sums: F64, lost: Mask, places: I64, unknowns: I64, out: F64) -> None:
    """Invert by sweeping every pivot, without exchange: H is positive."""
    size = unknowns.shape[0]
    h, scale = np.empty((size, size, _BLOCK)), np.empty((size, _BLOCK))
    pivot, factor = np.empty(_BLOCK), np.empty(_BLOCK)
    for start in range(0, sums.shape[0], _BLOCK):
        here = min(_BLOCK, sums.shape[0] - start)
        _gather(sums[start : start + here], lost[start : start + here], places, unknowns, h)
        _scale(h, scale)
        for p in range(size):
            _sweep(h, p, pivot, factor)
        for i in range(size):
            for k in range(i + 1):
                a, b, value = unknowns[i], unknowns[k], h[i, k]
                for n in range(here):
                    out[start + n, a, b] = -value[n] * scale[i, n] * scale[k, n]
                    out[start + n, b, a] = out[start + n, a, b]


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(sums: F64, lost: Mask, places: I64, unknowns: I64, h: F64) -> None:
    """Arrange the sums as the lower halves of H, unity where a point is lost."""
    light = places.shape[0] - 2
    for i in range(unknowns.shape[0]):
        for k in range(i + 1):
            a, b, into = unknowns[i], unknowns[k], h[i, k]
            place, sign = places[a, b], -1.0 if a >= light > b else 1.0
            for n in range(_BLOCK):
                into[n] = 1.0 if i == k else 0.0
            for n in range(sums.shape[0]):
                if not lost[n]:
                    into[n] = sign * sums[n, place]


@njit(cache=True, nogil=True, error_model="numpy")
def _scale(h: F64, scale: F64) -> None:
    """Scale matrices (K, K, B) to a unit diagonal, by what is written into `scale` (K, B)."""
    for i in range(h.shape[0]):
        square, into = h[i, i], scale[i]
        for n in range(_BLOCK):
            into[n] = 1.0 / np.sqrt(square[n] * (1 + _RIDGE)) if square[n] > 0 else 1.0
        for k in range(i):
            row, other = h[i, k], scale[k]
            for n in range(_BLOCK):
                row[n] *= into[n] * other[n]
        square[:] = 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def _sweep(h: F64, p: int, pivot: F64, factor: F64) -> None:
    """Sweep one pivot of matrices (K, K, B) of which the lower half is kept."""
    size, diagonal = h.shape[0], h[p, p]
    for n in range(_BLOCK):
        pivot[n] = 1.0 / diagonal[n]
    for i in range(size):
        if i == p:
            continue
        column = h[i, p] if i > p else h[p, i]
        for n in range(_BLOCK):
            factor[n] = column[n] * pivot[n]
        for k in range(i + 1):
            if k != p:
                other, into = h[k, p] if k > p else h[p, k], h[i, k]
                for n in range(_BLOCK):
                    into[n] -= factor[n] * other[n]
    for i in range(size):
        column = h[i, p] if i >= p else h[p, i]
        for n in range(_BLOCK):
            column[n] = column[n] * pivot[n] if i != p else -pivot[n]


def smallest_slope(sums: AnyArray, status: AnyArray, order: int) -> tuple[F64, I8]:
    """Find the direction in which each pattern is least steep, and name what is FLAT.

    Returns
    -------
    slope : (N,) float64, grey levels per px
        Root mean square of ∇f in that direction.
    status : (N,) int8
    """
    places, count = _places(order), shape.count(order)
    xx, yy, xy = (sums[:, places[i, k]] for i, k in ((0, 0), (count, count), (0, count)))
    pixels = sums[:, -1]
    smallest = (xx + yy) / 2 - np.hypot((xx - yy) / 2, xy)
    slope = np.sqrt(np.maximum(smallest, 0) / np.maximum(pixels, 1))
    usable = status == Status.OK
    if not usable.any():
        return slope, status
    steepest = np.sqrt((xx + yy)[usable] / np.maximum(pixels[usable], 1)).max()
    flat = usable & (slope <= _FLAT * steepest)
    return slope, np.where(flat, Status.FLAT, status).astype(np.int8)

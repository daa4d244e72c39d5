"""Sums of products of pixels and monomials over many windows, cheaply.

A row of pixels is a few rows of *terms*. Down the image each term is added up column by column,
with the powers of y that are asked for, so that the sum over the rows of a window is a difference
of two running sums and its cost does not depend on the size of the window; then the columns of a
window are summed with the powers of x. Both powers are taken about the middle of the window.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dic.arrays import F32, F64, I64, AnyArray
from dic.compiled import njit
from dic.fields.shape import monomials


class SumPlan(NamedTuple):
    """Which sums to take.

    Attributes
    ----------
    columns : (V, 2) int64
        Term and power of y of each running sum; powers of one term stand together, rising.
    sums : (S, 2) int64
        Running sum and power of x of each result.
    """

    columns: I64
    sums: I64


def plan(degrees: list[int]) -> SumPlan:
    """Sum term k with every monomial up to `degrees[k]`: results term by term, in that order."""
    columns = [(k, b) for k, degree in enumerate(degrees) for b in range(degree + 1)]
    place = {column: n for n, column in enumerate(columns)}
    sums = [(place[k, b], a) for k, degree in enumerate(degrees) for a, b in monomials(degree)]
    return SumPlan(np.array(columns), np.array(sums))


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def add_row(terms: F32, y: float, columns: AnyArray, total: F64) -> None:
    """Add a row of terms (K, n) at the height y to the running sums (V, n)."""
    for v in range(columns.shape[0]):
        row, into, factor = terms[columns[v, 0]], total[v], y ** columns[v, 1]
        for x in range(row.shape[0]):
            into[x] += factor * np.float64(row[x])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def close(total: F64, opened: F64, y: float, columns: AnyArray, out: F64) -> None:
    """Write the running sums since `opened`, with the powers of y about the height `y`."""
    highest = 0
    for v in range(columns.shape[0]):
        highest = max(highest, columns[v, 1])
        now, before, into = total[v], opened[v], out[v]
        for x in range(now.shape[0]):
            into[x] = now[x] - before[x]
    # Σ(y - c)^b from Σy^b: multiply by (y - c) once for each power, the highest first.
    for power in range(1, highest + 1):
        for v in range(columns.shape[0] - 1, -1, -1):
            if columns[v, 1] >= power:
                lower, into = out[v - 1], out[v]
                for x in range(lower.shape[0]):
                    into[x] -= y * lower[x]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def along(columns: AnyArray, first: int, powers: F64, sums: I64, out: F64) -> None:
    """Sum columns (V, n) over the window that starts at `first`, with `powers` (A, side) of x.

    What the window has beyond the columns counts nothing.
    """
    start, stop = max(first, 0), min(first + powers.shape[1], columns.shape[1])
    for s in range(sums.shape[0]):
        column, power = columns[sums[s, 0], start:stop], powers[sums[s, 1], start - first :]
        total = 0.0
        for x in range(column.shape[0]):
            total += power[x] * column[x]
        out[s] = total


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def raise_powers(middle: float, powers: F64) -> None:
    """Write (x - middle)^a into `powers` (A, side), x = 0 … side - 1."""
    for x in range(powers.shape[1]):
        powers[0, x] = 1.0
        for a in range(1, powers.shape[0]):
            powers[a, x] = powers[a - 1, x] * (x - middle)


@njit(cache=True, nogil=True)
def open_windows(ys: I64, side: int) -> int:
    """Count the windows of `side` px at the heights `ys` (R,) that can be open at one time."""
    return 1 if ys.shape[0] == 1 else min(side // (ys[1] - ys[0]) + 1, ys.shape[0])

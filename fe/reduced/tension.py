"""Stiffness of a plate from stress in its plane, put together element by element.

The same matrix is a product of sparse ones, which takes four times as long; it is wanted at each
step of each state that a reduced plate is made from.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe.arrays import F64, I32, Mask
from fe.compiled import njit
from fe.elements.gauss import Axis, Gauss
from fe.elements.line import Line


@dataclass(frozen=True, eq=False)
class TensionPattern:
    """Where the entries of the elements stand in the sparse matrix of the free unknowns.

    Attributes
    ----------
    where : (nx, ny, 16, 16) int32
        Entry of each pair of functions of an element; -1 where one of them is held.
    starts, rows : (N + 1,), (entries,) int32
        Columns and rows of the matrix, compressed by columns.
    x, y : pair of (n, points, 4) float64
        Values and slopes of the four functions of each element of a line.
    """

    where: I32
    starts: I32
    rows: I32
    x: tuple[F64, F64]
    y: tuple[F64, F64]

    def matrix(self, weighed: F64) -> sp.csc_array:
        """Assemble the matrix of stress times area (3, gx, gy) N: (N, N), N/mm."""
        data = np.zeros(len(self.rows))
        _assemble(np.ascontiguousarray(weighed), *self.x, *self.y, self.where, data)
        size = len(self.starts) - 1
        return sp.csc_array((data, self.rows, self.starts), shape=(size, size))


def tension_pattern(gauss: Gauss, lines: tuple[Line, Line], free: Mask) -> TensionPattern:
    """Find the pattern for a mesh and the unknowns (2 nx + 2, 2 ny + 2) that are free."""
    number = np.where(free, np.cumsum(free).reshape(free.shape) - 1, -1)
    first, second = (2 * np.arange(line.count)[:, None] + np.arange(4) for line in lines)
    own = number[first[:, None, :, None], second[None, :, None, :]].reshape(-1, 16)
    rows, columns = np.broadcast_arrays(own[:, :, None], own[:, None, :])
    there = (rows >= 0) & (columns >= 0)
    size = int(free.sum())
    keys, entries = np.unique(columns[there] * size + rows[there], return_inverse=True)
    where = np.full(rows.shape, -1, dtype=np.int32)
    where[there] = entries
    starts = np.searchsorted(keys, np.arange(size + 1) * size)
    return TensionPattern(
        where.reshape(lines[0].count, lines[1].count, 16, 16),
        starts.astype(np.int32),
        (keys % size).astype(np.int32),
        _local(gauss.x, lines[0].count),
        _local(gauss.y, lines[1].count),
    )


def _local(axis: Axis, elements: int) -> tuple[F64, F64]:
    """Values and slopes of the functions of each element at its points, (n, points, 4) each."""
    points = len(axis.places) // elements
    rows = np.arange(len(axis.places)).reshape(elements, points, 1)
    columns = 2 * np.arange(elements)[:, None, None] + np.arange(4)
    return axis.value[rows, columns], axis.slope[rows, columns]


@njit(cache=True, nogil=True)
def _assemble(
    weighed: F64, x_value: F64, x_slope: F64, y_value: F64, y_slope: F64, where: I32, data: F64
) -> None:
    points = x_value.shape[1]
    element = np.empty((16, 16))
    for a in range(where.shape[0]):
        for b in range(where.shape[1]):
            element[:] = 0.0
            for q in range(points):
                for r in range(points):
                    stress = weighed[:, points * a + q, points * b + r]
                    _add_point(
                        stress, x_value[a, q], x_slope[a, q], y_value[b, r], y_slope[b, r], element
                    )
            _scatter(element, where[a, b], data)


@njit(cache=True, nogil=True)
def _add_point(
    stress: F64, x_value: F64, x_slope: F64, y_value: F64, y_slope: F64, element: F64
) -> None:
    along, across = np.empty(16), np.empty(16)
    for i in range(16):
        along[i] = x_slope[i // 4] * y_value[i % 4]
        across[i] = x_value[i // 4] * y_slope[i % 4]
    for i in range(16):
        pull_x = stress[0] * along[i] + stress[2] * across[i]
        pull_y = stress[2] * along[i] + stress[1] * across[i]
        for j in range(16):
            element[i, j] += pull_x * along[j] + pull_y * across[j]


@njit(cache=True, nogil=True)
def _scatter(element: F64, where: I32, data: F64) -> None:
    for i in range(16):
        for j in range(16):
            if where[i, j] >= 0:
                data[where[i, j]] += element[i, j]

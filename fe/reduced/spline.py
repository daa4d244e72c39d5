"""Many smooth functions of a place on the plate, as cubic splines on one grid of places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Functions that a pass of the kernel keeps in the innermost cache.
_CHUNK = 512


@dataclass(frozen=True, eq=False)
class Table:
    """L functions as products of uniform cubic B-splines: two continuous derivatives.

    Attributes
    ----------
    size : tuple of float
        Sides (a, b) of the plate, mm.
    coefficients : (mx + 2, my + 2, L) float32
        For mx by my places spread evenly over the plate, its edges included. Single precision
        halves what is read; the splines it stores are as smooth as any.
    """

    size: tuple[float, float]
    coefficients: NDArray[np.float32]

    def at(self, xy: NDArray[np.float64], share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weighted mean of the functions over points, and its slopes when all points move.

        Parameters
        ----------
        xy : (Q, 2) float64, mm
        share : (Q,) float64
            Weights of sum 1.

        Returns
        -------
        (3, L) float64
            Value, d/dx and d/dy.
        """
        mx, my = (count - 2 for count in self.coefficients.shape[:2])
        x, y = _spread(xy[:, 0], self.size[0], mx), _spread(xy[:, 1], self.size[1], my)
        x[0] *= share[:, None]
        x[1] *= share[:, None]
        patch = np.stack([x[0].T @ y[0], x[1].T @ y[0], x[0].T @ y[1]], axis=-1)
        rows, columns = np.nonzero(np.abs(patch).max(axis=-1))
        return _mix(self.coefficients, rows, columns, patch[rows, columns])


def table(size: tuple[float, float], values: NDArray[np.float64]) -> Table:
    """Splines through values (mx, my, L) at places spread evenly over a plate."""
    along_x, along_y = (_interpolation(count) for count in values.shape[:2])
    rows = np.tensordot(along_x, values, 1)
    return Table(size, np.ascontiguousarray(along_y @ rows, dtype=np.float32))


def _interpolation(count: int) -> NDArray[np.float64]:
    """Matrix (m + 2, m) from values to coefficients; the first and last knots but one are none."""
    matrix = np.zeros((count + 2, count + 2))
    for place in range(count):
        matrix[place, place : place + 3] = 1 / 6, 4 / 6, 1 / 6
    matrix[count, :5] = matrix[count + 1, -5:] = 1, -4, 6, -4, 1
    return np.ascontiguousarray(np.linalg.inv(matrix)[:, :count], dtype=np.float64)


def _spread(x: NDArray, side: float, count: int) -> NDArray[np.float64]:
    """Weights (2, Q, m + 2) of the coefficients for value and slope at Q places."""
    step = side / (count - 1)
    cell = np.clip((x / step).astype(np.int64), 0, count - 2)
    t = x / step - cell
    s = 1.0 - t
    value = np.stack([s**3, 4 - 3 * t * t * (1 + s), 4 - 3 * s * s * (1 + t), t**3], axis=1) / 6
    slope = np.stack([-s * s, t * (3 * t - 4), s * (4 - 3 * s), t * t], axis=1) / (2 * step)
    weights = np.zeros((2, len(x), count + 2))
    place = np.arange(len(x))[:, None], cell[:, None] + np.arange(4)
    weights[0][place], weights[1][place] = value, slope
    return weights


@njit(cache=True, nogil=True, fastmath=True)
def _mix(coefficients: NDArray, rows: NDArray, columns: NDArray, weights: NDArray) -> NDArray:
    total = coefficients.shape[2]
    out = np.zeros((3, total))
    for first in range(0, total, _CHUNK):
        last = min(first + _CHUNK, total)
        value, along_x, along_y = out[0, first:last], out[1, first:last], out[2, first:last]
        for j in range(rows.size):
            row = coefficients[rows[j], columns[j], first:last]
            a, b, c = weights[j]
            for k in range(last - first):
                value[k] += a * row[k]
                along_x[k] += b * row[k]
                along_y[k] += c * row[k]
    return out

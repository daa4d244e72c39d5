"""Many smooth functions of a place on the plate, as cubic splines on one grid of places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe.arrays import F32, F64
from fe.compiled import njit

# Functions that a pass of the kernel keeps in the innermost cache.
_CHUNK = 512


@dataclass(frozen=True, eq=False)
class SplineTable:
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
    coefficients: F32

    def at(self, xy: F64, weight: F64) -> F64:
        """Weighted mean of the functions over points, and its slopes when all points move.

        Parameters
        ----------
        xy : (Q, 2) float64, mm
        weight : (Q,) float64
            Weights of sum 1.

        Returns
        -------
        (3, L) float64
            Value, d/dx and d/dy.
        """
        return _mix(self.coefficients, _patch(self.coefficients.shape[:2], self.size, xy, weight))


def table(size: tuple[float, float], values: F32 | F64) -> SplineTable:
    """Splines through values (mx, my, L) at places spread evenly over a plate."""
    along_x, along_y = (_interpolation(count) for count in values.shape[:2])
    total = values.shape[2]
    coefficients = np.empty((len(along_x), len(along_y), total), dtype=np.float32)
    for first in range(0, total, _CHUNK):
        part = values[:, :, first : first + _CHUNK].astype(np.float64)
        coefficients[:, :, first : first + _CHUNK] = along_y @ np.tensordot(along_x, part, 1)
    return SplineTable(size, coefficients)


def _interpolation(count: int) -> F64:
    """Matrix (m + 2, m) from values to coefficients; the first and last knots but one are none."""
    matrix = np.zeros((count + 2, count + 2))
    for place in range(count):
        matrix[place, place : place + 3] = 1 / 6, 4 / 6, 1 / 6
    matrix[count, :5] = matrix[count + 1, -5:] = 1, -4, 6, -4, 1
    return np.ascontiguousarray(np.linalg.inv(matrix)[:, :count], dtype=np.float64)


@njit(cache=True, nogil=True)
def _patch(shape: tuple[int, int], size: tuple[float, float], xy: F64, weight: F64):
    """Weights (mx + 2, my + 2, 3) of the coefficients for value, d/dx and d/dy of the mean."""
    patch = np.zeros((shape[0], shape[1], 3))
    step_x, step_y = size[0] / (shape[0] - 3), size[1] / (shape[1] - 3)
    for q in range(len(xy)):
        x, y = xy[q, 0] / step_x, xy[q, 1] / step_y
        row = min(max(int(x), 0), shape[0] - 4)
        column = min(max(int(y), 0), shape[1] - 4)
        value_x, slope_x = _cubics(x - row)
        value_y, slope_y = _cubics(y - column)
        for i in range(4):
            for j in range(4):
                weights = patch[row + i, column + j]
                weights[0] += weight[q] * value_x[i] * value_y[j]
                weights[1] += weight[q] * slope_x[i] * value_y[j] / step_x
                weights[2] += weight[q] * value_x[i] * slope_y[j] / step_y
    return patch


@njit(cache=True, nogil=True)
def _cubics(t: float):
    """Values and slopes of the four B-splines that are there, at t from 0 to 1 between knots."""
    s = 1.0 - t
    value = (s**3 / 6, (4 - 3 * t * t * (1 + s)) / 6, (4 - 3 * s * s * (1 + t)) / 6, t**3 / 6)
    slope = (-s * s / 2, t * (3 * t - 4) / 2, s * (4 - 3 * s) / 2, t * t / 2)
    return value, slope


@njit(cache=True, nogil=True, fastmath=True)
def _mix(coefficients: F32, patch: F64) -> F64:
    """Sum coefficients (mx + 2, my + 2, L) by three sets of weights: (3, L).

    Four places a pass: sums that pass through memory once for each place take twice as long.
    """
    total = coefficients.shape[2]
    rows, columns = np.nonzero(patch[:, :, 0])
    out = np.zeros((3, total))
    for first in range(0, total, _CHUNK):
        last = min(first + _CHUNK, total)
        value, along_x, along_y = out[0, first:last], out[1, first:last], out[2, first:last]
        for j in range(0, rows.size - 3, 4):
            r = coefficients[rows[j], columns[j], first:last]
            s = coefficients[rows[j + 1], columns[j + 1], first:last]
            t = coefficients[rows[j + 2], columns[j + 2], first:last]
            u = coefficients[rows[j + 3], columns[j + 3], first:last]
            a, b = patch[rows[j], columns[j]], patch[rows[j + 1], columns[j + 1]]
            c, d = patch[rows[j + 2], columns[j + 2]], patch[rows[j + 3], columns[j + 3]]
            for k in range(last - first):
                value[k] += a[0] * r[k] + b[0] * s[k] + c[0] * t[k] + d[0] * u[k]
                along_x[k] += a[1] * r[k] + b[1] * s[k] + c[1] * t[k] + d[1] * u[k]
                along_y[k] += a[2] * r[k] + b[2] * s[k] + c[2] * t[k] + d[2] * u[k]
        for j in range(rows.size - rows.size % 4, rows.size):
            row = coefficients[rows[j], columns[j], first:last]
            a = patch[rows[j], columns[j]]
            for k in range(last - first):
                value[k] += a[0] * row[k]
                along_x[k] += a[1] * row[k]
                along_y[k] += a[2] * row[k]
    return out

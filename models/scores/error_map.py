"""Errors as a map over the plate: where touches are reported well, and where they are not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arrays import F64, I64

CELLS = 12  # along the longer side


@dataclass(frozen=True, eq=False)
class ErrorMap:
    """Errors over the plate, in cells of equal size.

    Attributes
    ----------
    x : (C,) float64, mm
    y : (R,) float64, mm
        Middles of the cells.
    count : (R, C) int
        True touches.
    mean, largest : (R, C) float64, mm
        Of the errors; NaN where there is none.
    """

    x: F64
    y: F64
    count: I64
    mean: F64
    largest: F64


def error_map(xy: F64, error: F64, size: tuple[float, float]) -> ErrorMap:
    """Gather errors by where the true touches are.

    Parameters
    ----------
    xy : (N, 2) float64, mm
    error : (N,) float64, mm
        NaN for a touch that was not found; it is counted and not averaged.
    size : (float, float), mm
        Of the plate.
    """
    columns, rows = (max(round(CELLS * side / max(size)), 1) for side in size)
    column, row = (
        np.clip((place / side * cells).astype(int), 0, cells - 1)
        for place, side, cells in zip(xy.T, size, (columns, rows), strict=True)
    )
    cell, cells = row * columns + column, rows * columns
    found = np.isfinite(error)
    number = np.bincount(cell[found], minlength=cells)
    total = np.bincount(cell[found], error[found], minlength=cells)
    largest = np.full(cells, -np.inf)
    np.maximum.at(largest, cell[found], error[found])
    none = np.full(cells, np.nan)
    return ErrorMap(
        x=(np.arange(columns) + 0.5) * size[0] / columns,
        y=(np.arange(rows) + 0.5) * size[1] / rows,
        count=np.bincount(cell, minlength=cells).reshape(rows, columns),
        mean=np.divide(total, number, out=none.copy(), where=number > 0).reshape(rows, columns),
        largest=np.where(number > 0, largest, np.nan).reshape(rows, columns),
    )

"""Places on the grid of a test, between its points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import dic
from rig.system.arrays import F64, AnyArray


@dataclass(frozen=True, eq=False)
class Between:
    """Places on a grid, each between four of its points; NaN is read beyond the grid.

    Attributes
    ----------
    corners : (K, 4) int64
        Numbers of the points, row by row.
    weights : (K, 4) float64
        Of their values.
    """

    corners: NDArray[np.int64]
    weights: F64

    def read(self, values: AnyArray) -> F64:
        """Read a field (R·C,) or (R, C) at the places, (K,)."""
        cut = np.asarray(values, dtype=np.float64).ravel()[self.corners]
        return np.sum(np.where(self.weights == 0, 0, self.weights * cut), axis=1)

    def nearest(self) -> Between:
        """Return the nearest point of each place alone."""
        weights = np.where(np.isnan(self.weights), np.nan, 0.0)
        rows, last = np.arange(len(weights)), np.argmax(self.weights, axis=1)
        weights[rows, last] = np.where(np.isnan(self.weights[:, 0]), np.nan, 1.0)
        return Between(self.corners, weights)


def lay(grid: dic.Grid, places: F64) -> Between:
    """Find the points of a grid about places (K, 2) px."""
    rows, columns = grid.shape
    x = (places[:, 0] - grid.xs[0]) / grid.step
    y = (places[:, 1] - grid.ys[0]) / grid.step
    i = np.clip(np.floor(x), 0, max(columns - 2, 0)).astype(np.int64)
    j = np.clip(np.floor(y), 0, max(rows - 2, 0)).astype(np.int64)
    s, t = x - i, y - j
    right, below = np.minimum(i + 1, columns - 1), np.minimum(j + 1, rows - 1)
    corners = [row * columns + column for row in (j, below) for column in (i, right)]
    weights = np.stack([(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t], axis=1)
    outside = (x < 0) | (y < 0) | (x > columns - 1) | (y > rows - 1)
    weights[outside] = np.nan
    return Between(np.stack(corners, axis=1), weights)

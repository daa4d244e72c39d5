"""Smooth fields over the tiles of an image, held by a quarter as many numbers.

Plate modes and camera motion are smooth from tile to tile: a bicubic B-spline with a knot at every
second tile carries them, and the matrices of a frame shrink fourfold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from models.arrays import F64, AnyArray

TILES_A_KNOT = 2


@dataclass(frozen=True, eq=False)
class TileSpline:
    """Spreads spline coefficients over a grid of tiles.

    Attributes
    ----------
    down : (rows, m) float64
        Values of the m splines along y at the rows of tiles.
    across : (columns, n) float64
        Values of the n splines along x at the columns of tiles.
    down_slope, across_slope : float64, per tile
        Their derivatives.
    """

    down: F64
    across: F64
    down_slope: F64
    across_slope: F64

    def over_tiles(self, coefficients: F64) -> F64:
        """Values at the tiles, (m·n, k) → (T, k)."""
        return self._apply(self.down, self.across, coefficients)

    def project(self, values: F64) -> F64:
        """Adjoint of `over_tiles`, (T, k) → (m·n, k)."""
        return self._apply(self.down.T, self.across.T, values)

    def slopes(self, coefficients: F64) -> tuple[F64, F64]:
        """Differentiate along x and y at the tiles, (m·n, k) → two (T, k), per tile."""
        return (
            self._apply(self.down, self.across_slope, coefficients),
            self._apply(self.down_slope, self.across, coefficients),
        )

    def project_slopes(self, along_x: F64, along_y: F64) -> F64:
        """Adjoint of `slopes`, two (T, k) → (m·n, k)."""
        return self._apply(self.down.T, self.across_slope.T, along_x) + self._apply(
            self.down_slope.T, self.across.T, along_y
        )

    def fit(self, values: F64) -> F64:
        """Coefficients that come closest to values at the tiles, (T, k) → (m·n, k)."""
        return self._apply(np.linalg.pinv(self.down), np.linalg.pinv(self.across), values)

    def smooth_adjoint(self, values: F64) -> F64:
        """Adjoint of `over_tiles` after `fit`, (T, k) → (T, k)."""
        down, across = (np.linalg.pinv(part).T for part in (self.down, self.across))
        return self._apply(down, across, self.project(values))

    @staticmethod
    def _apply(down: AnyArray, across: AnyArray, values: F64) -> F64:
        # Two products of matrices; a product a row of tiles would take three times as long.
        fields = values.shape[1]
        rows = (down @ values.reshape(down.shape[1], -1)).reshape(len(down), -1, fields)
        grid = rows.swapaxes(1, 2).reshape(-1, across.shape[1]) @ across.T
        grid = grid.reshape(len(down), fields, len(across)).swapaxes(1, 2)
        return grid.reshape(-1, fields)


def spread_over(shape: tuple[int, int]) -> TileSpline:
    """Splines over `shape` = (rows, columns) of tiles, with a knot at every second one."""
    (down, down_slope), (across, across_slope) = (_splines(count) for count in shape)
    return TileSpline(down, across, down_slope, across_slope)


def _splines(count: int) -> tuple[F64, F64]:
    """Cubic B-splines at 0 … count - 1 and their derivatives, (count, number of splines) each."""
    degree = min(3, count - 1)
    spans = max(1, min(round((count - 1) / TILES_A_KNOT), count - degree))
    inner = np.linspace(0, max(count - 1, 1), spans + 1)
    knots = np.concatenate([np.full(degree, inner[0]), inner, np.full(degree, inner[-1])])
    splines = BSpline(knots, np.eye(len(knots) - degree - 1), degree)
    places = np.arange(count, dtype=np.float64)
    return splines(places), splines(places, nu=1)

"""The regular grid of points of interest (POIs) of a full-field measurement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dic.arrays import F64, I64


@dataclass(frozen=True)
class Grid:
    """Rows and columns of POIs; fields hold their R·C values row by row.

    Attributes
    ----------
    xs : (C,) int64 or float64, px
        Columns of the image at which POIs lie.
    ys : (R,) int64 or float64, px
        Rows of the image at which POIs lie.
    subset : int, px
        Side of the square subset around each POI, odd.
    step : int, px
        Distance of neighbouring POIs.
    """

    xs: I64 | F64
    ys: I64 | F64
    subset: int
    step: int

    @property
    def shape(self) -> tuple[int, int]:
        """(R, C), so that ``field.u.reshape(grid.shape)`` is an image."""
        return len(self.ys), len(self.xs)

    @property
    def pixels(self) -> tuple[I64, I64]:
        """`xs` and `ys` of a grid that lies on whole px, as int64."""
        return self.xs.astype(np.int64, copy=False), self.ys.astype(np.int64, copy=False)

    @property
    def xy(self) -> F64:
        """(R·C, 2) px, the POIs row by row."""
        x, y = np.meshgrid(self.xs, self.ys)
        return np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)


def grid_over(shape: tuple[int, int], subset: int, step: int) -> Grid:
    """Lay POIs over an image wherever the whole subset fits, the rest halved between the borders.

    Parameters
    ----------
    shape : (H, W), px
    subset, step : int, px
    """
    return Grid(_line(shape[1], subset, step), _line(shape[0], subset, step), subset, step)


def _line(length: int, subset: int, step: int) -> I64:
    room = length - subset
    start = subset // 2 + room % step // 2
    return start + step * np.arange(room // step + 1, dtype=np.int64)

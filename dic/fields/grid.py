"""The regular grid of points of interest (POIs) of a full-field measurement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Grid:
    """Rows and columns of POIs; fields hold their R·C values row by row.

    Attributes
    ----------
    xs : (C,) int64 or float64, px
        Columns of the picture at which POIs lie.
    ys : (R,) int64 or float64, px
        Rows of the picture at which POIs lie.
    subset : int, px
        Side of the square subset around each POI, odd.
    step : int, px
        Distance of neighbouring POIs.
    """

    xs: NDArray[np.int64] | NDArray[np.float64]
    ys: NDArray[np.int64] | NDArray[np.float64]
    subset: int
    step: int

    @property
    def shape(self) -> tuple[int, int]:
        """(R, C), so that ``field.u.reshape(grid.shape)`` is a picture."""
        return len(self.ys), len(self.xs)

    @property
    def xy(self) -> NDArray[np.float64]:
        """(R·C, 2) px, the POIs row by row."""
        x, y = np.meshgrid(self.xs, self.ys)
        return np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)


def grid_over(shape: tuple[int, int], subset: int, step: int) -> Grid:
    """Lay POIs over a picture wherever the whole subset fits, the remainder shared by the borders.

    Parameters
    ----------
    shape : (H, W), px
    subset, step : int, px
    """
    return Grid(_line(shape[1], subset, step), _line(shape[0], subset, step), subset, step)


def _line(length: int, subset: int, step: int) -> NDArray[np.int64]:
    room = length - subset
    start = subset // 2 + room % step // 2
    return start + step * np.arange(room // step + 1, dtype=np.int64)

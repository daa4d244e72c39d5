"""A lattice of small tiles under the points of a reference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dic.arrays import F64, I64
from dic.correlation.reference import Reference

TILE = 5  # px: white sums, and one tile a point of the usual grid


@dataclass(frozen=True)
class TileLattice:
    """Square tiles side by side over an image, their middles on whole px.

    Attributes
    ----------
    origin : (int, int), px
        Column and row of the middle of the first tile.
    shape : (rows, columns)
    """

    origin: tuple[int, int]
    shape: tuple[int, int]

    @property
    def xy(self) -> F64:
        """Middles of the tiles, (T, 2) px, row by row."""
        x, y = np.meshgrid(
            self.origin[0] + TILE * np.arange(float(self.shape[1])),
            self.origin[1] + TILE * np.arange(float(self.shape[0])),
        )
        return np.column_stack([x.ravel(), y.ravel()])

    def nearest(self, xy: F64) -> I64:
        """Tile nearest to each point (N, 2) px, (N,), row by row."""
        place = np.rint((xy - np.array(self.origin, float)) / TILE)
        column, row = np.clip(place, 0, np.array(self.shape[::-1]) - 1).astype(np.int64).T
        return row * self.shape[1] + column


def lay_lattice(ref: Reference) -> TileLattice:
    """Lay tiles over the whole image, so that points of a grid of step 5 are their middles."""
    height, width = ref.image.shape
    first = np.rint(ref.xy[0]).astype(int) if ref.grid is not None else np.array([2, 2])
    left, top = (TILE // 2 + (int(start) - TILE // 2) % TILE for start in first)
    columns, rows = (width - left + TILE // 2) // TILE, (height - top + TILE // 2) // TILE
    return TileLattice((left, top), (rows, columns))

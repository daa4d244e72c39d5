"""Values of a field on tiles at points between their middles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dic.adaptive.adaptive_tiles import AdaptiveTiles
from dic.adaptive.tile_lattice import TILE
from dic.arrays import F64, I64, Mask


@dataclass(frozen=True)
class PointValues:
    """A field at N points; NaN where no tile is near.

    Attributes
    ----------
    values : (2, 3, N) float64
        u, ∂u/∂x, ∂u/∂y and v, ∂v/∂x, ∂v/∂y, px and px per px.
    sigma : (2, 3, N) float64
    tile : (N,) int64
        The nearest tile, row by row.
    """

    values: F64
    sigma: F64
    tile: I64

    @property
    def known(self) -> Mask:
        """(N,) True where there is a value."""
        return np.asarray(np.isfinite(self.values).all(axis=(0, 1)))


def evaluate(field: AdaptiveTiles, xy: F64) -> PointValues:
    """Interpolate a field on tiles by cubics through values and slopes.

    Between tiles of which one has no value, as across a crack, the nearest one is carried on by its
    slopes; farther than half a tile from any there is none.
    """
    lattice = field.lattice
    place = (xy - np.array(lattice.origin, float)) / TILE  # (N, 2) x, y
    last = np.array(lattice.shape[::-1]) - 1
    nearest = np.clip(np.rint(place), 0, last).astype(np.int64)
    low = np.clip(np.floor(place), 0, np.maximum(last - 1, 0)).astype(np.int64)
    high = np.minimum(low + 1, last)
    tx, ty = (place - low).T
    corners = [(low[:, 1], low[:, 0], 0, 0), (low[:, 1], high[:, 0], 1, 0),
               (high[:, 1], low[:, 0], 0, 1), (high[:, 1], high[:, 0], 1, 1)]  # fmt: skip
    values, variance = np.zeros((2, 3, len(xy))), np.zeros((2, 3, len(xy)))
    missing: Mask = np.asarray(~np.isfinite(field.values).all(axis=(0, 1)))
    lost = np.zeros(len(xy), dtype=bool)
    seen = np.where(missing, 0.0, field.values)
    spread = np.where(missing, 0.0, field.stated_sigma**2)
    for row, column, right, below in corners:
        at = seen[..., row, column]
        wx, sx = _hermite(tx, right)
        wy, sy = _hermite(ty, below)
        linear = (tx if right else 1 - tx) * (ty if below else 1 - ty)
        values[:, 0] += wx * wy * at[:, 0] + sx * wy * at[:, 1] + wx * sy * at[:, 2]
        values[:, 1:] += linear * at[:, 1:]
        variance += linear * spread[..., row, column]
        lost |= missing[row, column] & (linear != 0)
    values[..., lost], variance[..., lost] = np.nan, np.nan
    inside = np.abs(place - nearest).max(axis=1) <= 0.5 + 1e-9
    alone = ~np.isfinite(values).all(axis=(0, 1)) & inside
    values[..., alone], variance[..., alone] = _carry(field, nearest[alone], place[alone])
    values[..., ~inside] = np.nan
    values[:, 1:] /= TILE
    variance[:, 1:] /= TILE**2
    return PointValues(values, np.sqrt(variance), lattice.nearest(xy))


def _hermite(t: F64, end: int) -> tuple[F64, F64]:
    """Weights of the value and of the slope at one end of an interval, at its fractions t."""
    s = 1 - t if end else t
    slope = s * (1 - s) ** 2
    return (1 + 2 * s) * (1 - s) ** 2, -slope if end else slope


def _carry(field: AdaptiveTiles, tile: I64, place: F64) -> tuple[F64, F64]:
    at = field.values[..., tile[:, 1], tile[:, 0]].copy()
    power = np.square(field.stated_sigma[..., tile[:, 1], tile[:, 0]])
    dx, dy = (place - tile).T
    at[:, 0] += at[:, 1] * dx + at[:, 2] * dy
    return at, power

"""Motion of the tiles from one pass to the next."""

from __future__ import annotations

import numpy as np

from dic.adaptive.blocks import BlockField
from dic.adaptive.tile_lattice import TILE, TileLattice
from dic.arrays import F64, I64
from dic.correlation import dense_motion
from dic.fields.displacement import DisplacementField


def start_motion(found: DisplacementField, lattice: TileLattice) -> F64:
    """Motion (2, 3, R, C) of the tiles, px: of the nearest point each, carried by its gradient.

    Points that were not measured take part with the motion of the nearest one that was, so that on
    each side of a crack the tiles move with their own side.
    """
    grid = found.grid
    if grid is None:
        raise ValueError("tiles start from a grid of points, got scattered ones; measure a grid")
    motion = np.empty((len(found.xy), 2, 3))
    motion[:, 0, 0], motion[:, 1, 0], motion[:, :, 1:] = found.u, found.v, found.gradient
    motion, _ = dense_motion.fill(found.xy, motion, found.valid)
    x, y = lattice.xy.T
    column, row = (_nearest(at, line) for at, line in ((x, grid.xs), (y, grid.ys)))
    near = motion[row * len(grid.xs) + column]
    away = np.column_stack([x, y]) - found.xy[row * len(grid.xs) + column]
    near[:, :, 0] += np.einsum("nak,nk->na", near[:, :, 1:], away)
    return np.ascontiguousarray(near.reshape(*lattice.shape, 2, 3).transpose(2, 3, 0, 1))


def _nearest(places: F64, line: I64 | F64) -> I64:
    """Index of the value of an even line that is nearest to each place."""
    step = line[1] - line[0] if len(line) > 1 else 1.0
    index = np.rint((places - line[0]) / step).astype(np.int64)
    return np.clip(index, 0, len(line) - 1)


def carried(field: BlockField) -> F64:
    """Motion (2, 3, R, C) of a field on tiles, px; where it has none, that of the nearest tile."""
    motion = field.values.copy()
    motion[:, 1:] /= TILE
    valid = field.valid
    if valid.all():
        return motion
    if not valid.any():
        return np.zeros_like(motion)
    from scipy.ndimage import distance_transform_edt

    nearest = distance_transform_edt(~valid, return_distances=False, return_indices=True)
    row, column = np.asarray(nearest)
    here = np.indices(valid.shape)
    motion = motion[:, :, row, column]
    motion[:, 0] += TILE * (motion[:, 1] * (here[1] - column) + motion[:, 2] * (here[0] - row))
    return motion

"""Motion of the tiles from one pass to the next."""

from __future__ import annotations

import numpy as np

from dic.adaptive.blocks import BlockField
from dic.adaptive.tile_lattice import TILE, TileLattice
from dic.arrays import F64, I64, Mask
from dic.correlation import dense_motion
from dic.fields.displacement import DisplacementField

TERMS = 6  # of the motion of a tile: itself, its gradient, its second derivatives


def start_motion(found: DisplacementField, lattice: TileLattice) -> F64:
    """Motion (2, 6, R, C) of the tiles, px: of the nearest point each, carried by its gradient.

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
    return straight(near, lattice)


def straight(motion: F64, lattice: TileLattice) -> F64:
    """Lay motions (T, 2, 3) of tiles on their lattice, (2, 6, R, C): nothing is known of bends."""
    laid = np.zeros((2, TERMS, *lattice.shape))
    laid[:, :3] = motion.reshape(*lattice.shape, 2, 3).transpose(2, 3, 0, 1)
    return laid


def _nearest(places: F64, line: I64 | F64) -> I64:
    """Index of the value of an even line that is nearest to each place."""
    step = line[1] - line[0] if len(line) > 1 else 1.0
    index = np.rint((places - line[0]) / step).astype(np.int64)
    return np.clip(index, 0, len(line) - 1)


def carried(field: BlockField, before: F64, known: Mask) -> F64:
    """Take the motion of a field to all tiles, (2, 6, R, C) px.

    Parameters
    ----------
    field : BlockField
    before : (2, 6, R, C) float64, px
        The motion so far.
    known : (R, C) bool
        Tiles with a pattern that no crack cuts. Those that touch are one part of the pattern.

    Returns
    -------
    (2, 6, R, C) float64, px
        A tile of which the field says nothing has the motion of the nearest one, if that is of the
        same part. What moves beyond a gap says nothing of a part that is too small for a block:
        it keeps the motion that it had.
    """
    motion = np.concatenate([field.values, _bends(field.values)], axis=1)
    motion[:, 1:3] /= TILE
    motion[:, 3:] /= TILE**2
    valid = field.valid
    if valid.all():
        return motion
    if not valid.any():
        return before.copy()
    from scipy.ndimage import distance_transform_edt, label

    nearest = distance_transform_edt(~valid, return_distances=False, return_indices=True)
    row, column = np.asarray(nearest)
    here = np.indices(valid.shape)
    motion = motion[:, :, row, column]
    motion[:, 3:, ~valid] = 0.0
    motion[:, 0] += TILE * (motion[:, 1] * (here[1] - column) + motion[:, 2] * (here[0] - row))
    part = np.asarray(label(known)[0])
    apart = known & ~valid & (part != part[row, column])
    motion[..., apart] = before[..., apart]
    return motion


def _bends(values: F64) -> F64:
    """Second derivatives (2, 3, R, C) of a field and its slopes (2, 3, R, C), px per tile².

    Beside a tile that has none, as at a crack or the border, they are 0.
    """
    bends = np.zeros_like(values)
    u, right, down = values[:, 0], values[:, 1], values[:, 2]
    bends[:, 0, :, 1:-1] = _second(u, right)
    bends[:, 2, 1:-1] = _second(u.swapaxes(1, 2), down.swapaxes(1, 2)).swapaxes(1, 2)
    both = down[:, 1:-1, 2:] - down[:, 1:-1, :-2] + right[:, 2:, 1:-1] - right[:, :-2, 1:-1]
    bends[:, 1, 1:-1, 1:-1] = 0.25 * both
    return np.nan_to_num(bends)


def _second(u: F64, slope: F64) -> F64:
    """Second derivative along the last axis by values and slopes, right to fourth order."""
    curved = 2.0 * (u[..., 2:] - 2.0 * u[..., 1:-1] + u[..., :-2])
    return curved - 0.5 * (slope[..., 2:] - slope[..., :-2])

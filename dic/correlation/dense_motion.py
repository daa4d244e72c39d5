"""The dense motion between the points of interest, from what the good ones say."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dic.arrays import F64, I64, Mask
from dic.compiled import njit
from dic.fields.grid import Grid


@dataclass(frozen=True)
class MotionGrid:
    """Motion on the grid of POIs, continued over the borders of the image.

    Attributes
    ----------
    motion : (2, R', C') float64, px
        u and v less the base, with enough rows and columns around the POIs for every pixel of every
        subset.
    base : (2,) int, px
        Whole part of the motion of the middle of the image.
    origin : (2,) int, px
        Column and row of the first node.
    step : int, px
    """

    motion: F64
    base: tuple[int, int]
    origin: tuple[int, int]
    step: int

    def weights(self) -> F64:
        """Weigh the four nodes around each pixel of a cell, (step, 4)."""
        return catmull_rom(self.step)


def catmull_rom(step: int) -> F64:
    """Weigh four nodes at each pixel between the middle two, (step, 4).

    The weights are those of Catmull and Rom: cubic, local, exact for parabolas.
    """
    t = np.arange(step) / step
    return np.stack(
        [
            t * (-1 + t * (2 - t)) / 2,
            1 + t * t * (-5 + 3 * t) / 2,
            t * (1 + t * (4 - 3 * t)) / 2,
            t * t * (t - 1) / 2,
        ],
        axis=1,
    )


def motion_grid(motion: F64, grid: Grid) -> MotionGrid:
    """Continue the motion of the POIs over the borders by their own gradients.

    Parameters
    ----------
    motion : (R·C, 2, P) float64
        Coefficients of the shape function of each POI, those of 1, ξ, η first.
    """
    margin = grid.subset // 2 // grid.step + 2
    nodes = np.pad(
        motion[:, :, :3].reshape(*grid.shape, 2, 3),
        ((margin, margin), (margin, margin), (0, 0), (0, 0)),
        mode="edge",
    )
    dy, dx = (grid.step * _beyond(n, margin) for n in grid.shape)
    u = nodes[..., 0] + nodes[..., 1] * dx[:, None] + nodes[..., 2] * dy[:, None, None]
    base = np.rint(np.median(motion[:, :, 0], axis=0)).astype(int)
    origin = int(grid.xs[0]) - margin * grid.step, int(grid.ys[0]) - margin * grid.step
    relative = np.ascontiguousarray(np.moveaxis(u - base, -1, 0))
    return MotionGrid(relative, (int(base[0]), int(base[1])), origin, grid.step)


def _beyond(count: int, margin: int) -> I64:
    """Count the steps by which each node of a continued line lies beyond its ends."""
    place = np.arange(-margin, count + margin)
    return place - np.clip(place, 0, count - 1)


def fill(
    xy: F64,
    motion: F64,
    good: Mask,
    reach: float = np.inf,
) -> tuple[F64, Mask]:
    """Give each point that is not good the motion of its nearest good neighbour, by its gradient.

    Parameters
    ----------
    xy : (N, 2) px
    motion : (N, 2, P)
        As for `motion_grid`.
    good : (N,) bool
    reach : float, px
        Neighbours farther away than this say nothing.

    Returns
    -------
    filled : (N, 2, P)
    given : (N,) bool
        Where a motion was given.
    """
    given = ~good
    if not given.any() or not good.any():
        return motion, np.zeros(len(xy), dtype=bool)
    from scipy.spatial import KDTree

    # Few are asked for: a tree that is soon built.
    tree = KDTree(xy[good], balanced_tree=False, compact_nodes=False)
    distance, nearest = map(np.asarray, tree.query(xy[given]))
    near = distance <= reach
    given[given] = near
    source, filled = np.flatnonzero(good)[nearest[near]], motion.copy()
    _carry(xy, motion, source, np.flatnonzero(given), filled)
    return filled, given


@njit(cache=True, nogil=True)
def _carry(xy: F64, motion: F64, source: I64, target: I64, filled: F64) -> None:
    for n in range(target.shape[0]):
        here, there = source[n], target[n]
        x, y = xy[there, 0] - xy[here, 0], xy[there, 1] - xy[here, 1]
        for a in range(2):
            for k in range(motion.shape[2]):
                filled[there, a, k] = motion[here, a, k]
            filled[there, a, 0] += motion[here, a, 1] * x + motion[here, a, 2] * y

"""Tiles that a crack cuts: they part the blocks, and the rest moves with its own side."""

from __future__ import annotations

import numpy as np

from dic.adaptive import tile_kernels
from dic.adaptive.motion import straight
from dic.adaptive.observation import TileTexture, lines, residual
from dic.adaptive.tile_lattice import TILE
from dic.arrays import F32, F64, Mask
from dic.correlation.reference import Reference
from dic.fields.displacement import DisplacementField, Status

_JUMP = 0.12  # px, between the motions of both sides
_BEYOND = 1.5  # of the distance to its own side, at which a tile looks for the other one
_UNLIKE, _AT_MOST = 2.0, 0.4  # times the usual residual, and the fraction of tiles with more
_PARTED = 0.5  # of the jump, by which tiles on either side differ
_STEEP = 0.5  # of what slopes on either side explain: as much of a step may be a short wave


def part(
    ref: Reference, texture: TileTexture, spline: F32, motion: F64, found: DisplacementField
) -> tuple[F64, Mask]:
    """Give each tile near a crack the motion of its own side.

    Parameters
    ----------
    motion : (2, 6, R, C) float64, px
        As it starts: that of the nearest point that was measured.
    found : DisplacementField
        Its points are BROKEN where a subset lies across a crack.

    Returns
    -------
    motion : (2, 6, R, C) float64, px
    torn : (R, C) bool
        Tiles that the crack cuts.
    """
    shape = texture.lattice.shape
    torn = np.zeros(shape, bool)
    if not (found.status == Status.BROKEN).any():
        return motion, torn
    near, other = _both_sides(texture.lattice.xy, found)
    jump = np.linalg.norm(other[:, :, 0] - motion[:, 0].reshape(2, -1).T, axis=1)
    near &= jump > _JUMP
    if not near.any():
        return motion, torn
    there = straight(other, texture.lattice)
    own, across = (_left_over(ref, texture, spline, each) for each in (motion, there))
    band = _two_motions(near.reshape(shape), np.minimum(own, across))
    crossed = band & (across < own)
    chosen = np.where(crossed, there, motion)
    rest = np.where(crossed, across, own)
    return chosen, _between(chosen[:, 0], rest, np.where(band, jump.reshape(shape), np.inf))


def still_torn(torn: Mask, values: F64) -> Mask:
    """Keep the torn tiles across which a field (2, 3, R, C) jumps, or of which it says nothing.

    A steep wave that subsets lost at a border looks torn as long as its motion is not known.
    """
    if not torn.any():
        return torn
    u, right, down = values[:, 0], values[:, 1], values[:, 2]
    across = _step_over(u, right)
    along = _step_over(u.swapaxes(1, 2), down.swapaxes(1, 2)).T
    known = np.isfinite(across) | np.isfinite(along)
    return lines(torn & (~known | (across > _JUMP) | (along > _JUMP)))


def _step_over(u: F64, slope: F64) -> F64:
    """Step from the tile before to the one after each, beyond that of a wave, (R, C) px."""
    step = np.full(u.shape[1:], np.nan)
    explained = slope[..., 2:] + slope[..., :-2]
    rest = np.abs(u[..., 2:] - u[..., :-2] - explained) - _STEEP * np.abs(explained)
    step[:, 1:-1] = rest.max(axis=0)
    return step


def _two_motions(near: Mask, rest: F64) -> Mask:
    """Keep the regions in which one of two motions fits nearly every tile: no wave is like that."""
    from scipy.ndimage import label

    usual = float(np.median(rest[~near])) if not near.all() else float(np.median(rest))
    regions = np.asarray(label(near, np.ones((3, 3), int))[0])
    count = np.maximum(np.bincount(regions.ravel()), 1)
    unlike = np.bincount(regions.ravel(), (rest > _UNLIKE * usual).ravel()) / count
    return near & (unlike[regions] < _AT_MOST)


def _both_sides(xy: F64, found: DisplacementField) -> tuple[Mask, F64]:
    """Tiles (T,) near a crack, and the motion (T, 2, 3) of the far side, carried to them."""
    from scipy.spatial import KDTree

    valid = found.valid
    points = KDTree(found.xy[valid])
    _, own = points.query(xy)
    away = found.xy[valid][own] - xy
    _, far = points.query(xy - _BEYOND * away)
    broken, _ = KDTree(found.xy[found.status == Status.BROKEN]).query(xy)
    moved = np.empty((int(valid.sum()), 2, 3))
    moved[:, 0, 0], moved[:, 1, 0] = found.u[valid], found.v[valid]
    moved[:, :, 1:] = found.gradient[valid]
    other = moved[far]
    other[:, :, 0] += np.einsum("nak,nk->na", other[:, :, 1:], xy - found.xy[valid][far])
    return broken <= TILE * np.sqrt(0.5), other


def _left_over(ref: Reference, texture: TileTexture, spline: F32, motion: F64) -> F64:
    """Σr² of each tile for a motion, (R, C)."""
    frame = np.empty((*texture.lattice.shape, tile_kernels.OF_FRAME))
    laid = np.ascontiguousarray(np.moveaxis(motion, (0, 1), (2, 3)))
    tile_kernels.sum_frame(ref.texture, spline, *texture.lattice.origin, laid, frame)
    return residual(texture.sums, frame, texture.known)[1]


def _between(moved: F64, rest: F64, jump: F64) -> Mask:
    """Of neighbours on either side of a crack, the one that fits less."""
    torn = np.zeros(rest.shape, bool)
    _mark(moved, rest, jump, torn)
    _mark(moved.swapaxes(1, 2), rest.T, jump.T, torn.T)
    return torn


def _mark(moved: F64, rest: F64, jump: F64, torn: Mask) -> None:
    """Do so for neighbours along a row, whose jump (R, C) px is infinite away from cracks."""
    apart = np.linalg.norm(np.diff(moved, axis=2), axis=0)
    size = np.minimum(jump[:, 1:], jump[:, :-1])
    parted = np.isfinite(size) & (apart > _PARTED * size)
    worse = rest[:, :-1] >= rest[:, 1:]
    torn[:, :-1] |= parted & worse
    torn[:, 1:] |= parted & ~worse

"""Subsets that lie across a break of the material, such as a crack: two motions in one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dic.arrays import F64, I8, I64, Mask
from dic.correlation.deformed_image import DeformedImage
from dic.correlation.jumps import REACH, jumps
from dic.correlation.newton import Points
from dic.correlation.reference import Reference
from dic.fields.displacement import Status
from dic.fields.grid import Grid
from dic.numbers import median

SUSPECT = 3.5  # σ above the usual noise from which a subset is looked at
JUMP = 0.2  # px, between the two motions
PLAIN = 30.0  # χ² of a jump that no noise makes: along the best of all lines 1 in 1000 is above 24
_TOUCHED = 1.0  # of half a subset, from its middle: a break farther out does no harm
_LINKED = 8.0  # of half a subset: between two lines so far apart the material is broken too
_FAR = 0.1  # px beside a line by which a px along it is less sure: eight directions are tried
_ALIKE = 0.45  # of a jump, by which that between the points on both sides may differ
USUAL = 7.0  # times the usual difference between points as far apart, that is no jump
_PROBES = 200  # points at which the usual difference is looked at
_LOUDER = 1.5  # σ above the usual noise, that a neighbour of a break must be
_LARGE = 0.1  # of what a subset leaves over, that a jump takes where no points stand beside it


class Lines(NamedTuple):
    """Lines along which the material has broken.

    Attributes
    ----------
    normal : (L, 2) float64
    place : (L, 2) float64, px
        A point of each.
    seen_by : (L,) int64
        The point whose subset shows it.
    """

    normal: F64
    place: F64
    seen_by: I64


_NO_LINES = Lines(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0, dtype=np.int64))


def lines(ref: Reference, points: Points, frame: DeformedImage, noise: F64, status: I8) -> Lines:
    """Find the lines of breaks that cross the middle of a subset for certain."""
    torn = _torn(ref, points.motion, status)
    loud = np.flatnonzero(torn | _louder(ref, noise, status, SUSPECT))
    if not len(loud):
        return _NO_LINES
    level = noise / median(noise[status == Status.OK])
    first = loud[sparse(ref, loud)]
    clear, found = _clear(ref, points, frame, level, first)
    if not len(clear):
        return _NO_LINES
    beside = np.setdiff1d(_around(ref, clear, loud), first)
    more, theirs = _clear(ref, points, frame, level, beside)
    clear, found = np.concatenate([clear, more]), np.concatenate([found, theirs])
    jump, normal = found[:, 2:4], found[:, 4:6]
    place = ref.xy[clear] + found[:, 6:] * normal
    beside = _beside(ref, points.motion, status, place, normal)
    size, far = np.linalg.norm(jump, axis=1), np.linalg.norm(beside, axis=1)
    alike = np.linalg.norm(beside - jump, axis=1) < _ALIKE * size
    strong = found[:, 0] > np.maximum(PLAIN, _LARGE * ref.light[clear, 2])
    alike &= far > USUAL * _usual(ref, points.motion, status)
    alone = np.isnan(far)
    agreed: Mask = (alone & strong) | (~alone & alike)
    return Lines(normal[agreed], place[agreed], clear[agreed])


def _torn(ref: Reference, motion: F64, status: I8) -> Mask:
    """Whether motions on both sides of a point of a grid, just out of its reach, differ, (N,).

    Half a pixel in a noise of 5 grey levels adds 2 σ to what a subset leaves over, whose pixels are
    many, and 10 σ to this.
    """
    if ref.grid is None:
        return np.zeros(len(ref.xy), dtype=bool)
    known = np.where(status == Status.OK, motion[:, :, 0].T, np.nan)
    u, reach = known.reshape(2, *ref.grid.shape), across_subset(ref.grid)
    apart = np.zeros(ref.grid.shape)
    for field, into in ((u, apart), (u.swapaxes(1, 2), apart.T)):
        if field.shape[1] > 2 * reach:
            moved = np.square(field[:, 2 * reach :] - field[:, : -2 * reach]).sum(axis=0)
            into[reach:-reach] = np.fmax(into[reach:-reach], moved)
    apart = np.sqrt(apart.ravel())
    return apart > max(JUMP, USUAL * median(apart))


def across_subset(grid: Grid) -> int:
    """Count the steps of a grid from a point to the first whose subset does not reach it."""
    return -(-(grid.subset // 2 + 1) // grid.step)


def sparse(ref: Reference, here: I64) -> Mask:
    """Take so many of the points `here` that a line crosses the middle of one in any row of a grid.

    A field that bends is louder everywhere, a break along a line: where these show none, there is
    none.
    """
    if ref.grid is None:
        return np.ones(len(here), dtype=bool)
    apart = max(int(2 * REACH * ref.half / ref.grid.step), 1)
    row, column = np.divmod(here, ref.grid.shape[1])
    return (row % apart == 0) & (column % apart == 0)


def _around(ref: Reference, clear: I64, loud: I64) -> I64:
    """Take the points `loud` near those of which a break is clear."""
    near = _neighbours(ref.xy[clear], ref.xy[loud], _LINKED * ref.half)
    return loud[np.unique(np.array([k for some in near for k in some], dtype=np.int64))]


def _clear(
    ref: Reference, points: Points, frame: DeformedImage, level: F64, here: I64
) -> tuple[I64, F64]:
    """Find which of the points `here` show a jump and no curve, and the jumps, as from `jumps`."""
    found = jumps(ref, points, frame, here, JUMP)
    found[:, :2] /= ref.noise_gain[here].mean(axis=1, keepdims=True)
    of_jump, of_curve = found[:, :2].T
    # What a gap leaves over is no noise: the jump is seen beside that of the other subsets.
    kept = (of_jump * np.maximum(level[here], 1) ** 2 > PLAIN) & (of_jump > of_curve)
    return here[kept], found[kept]


def across(ref: Reference, found: Lines, noise: F64, status: I8) -> I64:
    """Find the points whose subset lies across a break.

    A subset whose middle the break crosses shows it: a jump along a line takes more of what the fit
    leaves over than any curve does, and the points on both sides have moved apart by as much. Where
    the break cuts only a side of a subset, jump and curve look alike; those points are known by the
    lines of their neighbours, and are louder than others, or lie between two lines.
    """
    if not len(found.seen_by):
        return np.zeros(0, dtype=np.int64)
    every = crossed(ref, found, np.isin(status, (Status.OK, Status.DISTURBED)))
    loud = _louder(ref, noise, status, _LOUDER)[every.points]
    return every.points[loud | every.linked]


class Crossed(NamedTuple):
    """Points whose subset a line crosses.

    Attributes
    ----------
    points, line : (M,) int64
        And the line of each: the one that it shows itself, or else the nearest.
    apart : (M,) float64, px
        Distance of the nearest line.
    linked : (M,) bool
        Whether there are lines before and behind the point, along the break.
    """

    points: I64
    line: I64
    apart: F64
    linked: Mask


def crossed(ref: Reference, found: Lines, among: Mask) -> Crossed:
    """Find the points `among` (N,) bool whose subset a line crosses, or the link of two lines."""
    nearest, line = np.full(len(ref.xy), np.inf), np.full(len(ref.xy), -1)
    apart = np.full(len(ref.xy), np.inf)
    beside, sides = np.zeros(len(ref.xy), dtype=bool), np.zeros((2, len(ref.xy)), dtype=bool)
    near = _neighbours(ref.xy[found.seen_by], ref.xy, (_LINKED + 0.5) * ref.half)
    for k, some in enumerate(near):
        normal, others = found.normal[k], np.array(some, dtype=np.int64)
        away = ref.xy[others] - found.place[k]
        along, off = away @ _along(normal), np.abs(away @ normal)
        distance = off + _FAR * np.abs(along)
        reached = distance <= _TOUCHED * ref.half * np.abs(normal).sum()
        reached &= np.abs(along) <= _LINKED * ref.half
        others, along, off, distance = (a[reached] for a in (others, along, off, distance))
        beside[others[np.abs(along) <= ref.half]] = True
        sides[0, others[along >= 0]] = sides[1, others[along <= 0]] = True
        close = distance < nearest[others]
        nearest[others[close]], line[others[close]] = distance[close], k
        apart[others[close]] = off[close]
    linked: Mask = np.asarray(sides.all(axis=0))
    line[~(beside | linked)] = -1
    line[found.seen_by] = np.arange(len(found.seen_by))
    here = np.flatnonzero((line >= 0) & among)
    return Crossed(here, line[here], apart[here], linked[here])


def _along(normal: F64) -> F64:
    """Direction (2,) of a line, the same for all that are nearly parallel, upright ones too."""
    direction = np.array([-normal[1], normal[0]])
    return direction if direction @ (1.0, 0.2) > 0 else -direction


def _beside(ref: Reference, motion: F64, status: I8, place: F64, normal: F64) -> F64:
    """Jump (M, 2) px between the points on both sides of lines, just out of reach of the break.

    NaN where there is none on one side.
    """
    from scipy.spatial import KDTree

    valid = np.flatnonzero(status == Status.OK)
    away = (ref.half + 1) * np.abs(normal).sum(axis=1, keepdims=True) * normal
    tree = KDTree(ref.xy[valid])
    (near, low), (far, high) = (tree.query(place + side * away) for side in (-1, 1))
    low, high = valid[low], valid[high]
    apart = ref.xy[high] - ref.xy[low]
    slope = (motion[low, :, 1:3] + motion[high, :, 1:3]) / 2
    jump = motion[high, :, 0] - motion[low, :, 0] - np.einsum("mab,mb->ma", slope, apart)
    jump[np.maximum(near, far) > ref.half] = np.nan
    return jump


def _usual(ref: Reference, motion: F64, status: I8) -> float:
    """Median difference between points as far apart as those on both sides of a break, px."""
    valid = np.flatnonzero(status == Status.OK)
    some = valid[np.unique(np.linspace(0, len(valid) - 1, _PROBES).astype(int))]
    normal = np.eye(2)[np.arange(len(some)) % 2]
    apart = np.linalg.norm(_beside(ref, motion, status, ref.xy[some], normal), axis=1)
    return float(np.median(apart[np.isfinite(apart)])) if np.isfinite(apart).any() else 0.0


def _louder(ref: Reference, noise: F64, status: I8, sigmas: float) -> Mask:
    """Points that leave more over than the others, by so many σ of what noise does, (N,) bool."""
    valid = status == Status.OK
    level = median(noise[valid]) if valid.any() else np.inf
    limit = 1 + sigmas / np.sqrt(2 * np.maximum(ref.light[:, 2], 1))
    return (valid | (status == Status.DISTURBED)) & (noise > limit * level)


def _neighbours(xy: F64, around: F64, reach: float) -> list[list[int]]:
    """Points of `around` within a square of ±`reach` px of each of `xy`."""
    if not len(xy):
        return []
    from scipy.spatial import KDTree

    tree = KDTree(around)
    return [list(tree.query_ball_point(place, reach, p=np.inf)) for place in xy]

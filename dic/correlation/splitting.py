"""Subsets that lie across a break and keep their larger side.

Subset splitting after Poissant and Barthelat (Experimental Mechanics 50, 2010): the line of the
break is known from what the whole subset leaves over (`breaks`), the pixels beyond it and those
close to it count nothing, and the point is iterated anew from the motion of its own side.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import F32, F64, I64, Mask
from dic.correlation import breaks, moments, normal, point_status
from dic.correlation.correlation import iterate
from dic.correlation.newton import Points
from dic.correlation.reference import Reference
from dic.correlation.subset import gather
from dic.fields import shape
from dic.fields.displacement import DisplacementField, Status

_MARGIN = 0.35  # of half a subset: a line is known to 0.15 of it across, and to 11°
_SURE = 0.3  # of half a subset: a point nearer to a line may lie on either side of it
_CUT = 0.85  # of half a subset: a line farther out may as well lie outside it
_RIM = 2.0  # px beside the rim of a gap, which interpolation mixes with what is seen in it
_KEPT = 0.25  # fraction of a subset that must be left
_LEVEL = 1.25  # times the noise of the whole subsets, above which a side is not all of one motion
_NEAR = 64  # points among which that of the same side is looked for
_BLOCK = 512  # subsets summed at a time
_LOST = Status.BROKEN, Status.DISTURBED, Status.LOW_CORRELATION, Status.NOT_CONVERGED


def correlate_split(
    ref: Reference, image: ArrayLike, guess: DisplacementField | ArrayLike | None = None
) -> DisplacementField:
    """Correlate as `correlate`, and measure a subset across a break by its larger side.

    Returns
    -------
    DisplacementField
        What was measured of one side has the status SPLIT, its σ and the fraction of pixels that
        were used. It is not `valid`: strain windows, which would reach across the break, leave it
        out.

    Raises
    ------
    ValueError
        As `correlate`.
    """
    points, frame = iterate(ref, image, guess)
    field, lines = point_status.field_and_breaks(ref, points, frame)
    here, line, apart, _ = breaks.crossed(ref, lines, np.isin(field.status, _LOST))
    if not len(here) or not field.valid.any():
        return field
    sided = _one_side(ref, here, lines.normal[line], lines.place[line])
    start, known = _beside(ref, points.motion, field.valid, here, lines, line)
    outer = _CUT * ref.half * np.abs(lines.normal[line]).sum(axis=1)
    sided.status[~known | (apart < _SURE * ref.half) | (apart > outer)] = Status.BROKEN
    alone = Points(start)
    alone.iterate(sided, frame, np.flatnonzero(sided.status == Status.OK))
    measured = point_status.displacement_field(sided, alone, frame)
    level = np.median(point_status.noise_of(ref, points)[field.valid])
    good = measured.valid & (point_status.noise_of(sided, alone) <= _LEVEL * level)
    return _merged(field, here[good], measured, good)


def _one_side(ref: Reference, here: I64, normals: F64, places: F64) -> Reference:
    """Take the points `here` with the pixels on their own side of a line alone."""
    xy, status = ref.xy[here], np.zeros(len(here), dtype=np.int8)
    subsets = gather(ref.texture, xy, ref.half)
    sums = np.empty((len(here), len(moments.reference_plan(ref.order).sums)))
    away = np.einsum("nk,nk->n", xy - places, normals)
    for first in range(0, len(here), _BLOCK):
        some = np.s_[first : first + _BLOCK]
        arms = _arms(xy[some], ref.half, subsets.shape[2])
        along = np.einsum("nkp,nk->np", arms, normals[some]) + away[some, None]
        side = np.where(away[some] < 0, -1.0, 1.0)[:, None]
        inside = along * side >= max(_MARGIN * ref.half, _RIM + 1.0)
        subsets[some] *= inside[:, None]
        sums[some] = _sums(subsets[some], arms, ref.order)
    status[sums[:, -1] < _KEPT * ref.subset**2] = Status.BROKEN
    slope, status = normal.smallest_slope(sums, status, ref.order)
    return replace(
        ref, xy=xy, inverse=normal.inverse(sums, status, ref.order), light=sums[:, -3:].copy(),
        slope=slope, noise_gain=ref.noise_gain[here], status=status, grid=None, subsets=subsets,
        device=None,
    )  # fmt: skip


def _arms(xy: F64, half: int, pixels: int) -> F64:
    """Distance (N, 2, pixels) px of the pixels of subsets from their points."""
    width = pixels // (2 * half + 1)
    row, column = np.divmod(np.arange(pixels), width)
    middle = np.array([column - half, row - half], dtype=np.float64)
    return middle + (np.rint(xy) - xy)[:, :, None]


def _sums(subsets: F32, arms: F64, order: int) -> F64:
    """Sum as `moments.reference_plan` says, (N, S)."""
    fx, fy, f, weight = subsets.astype(np.float64).transpose(1, 0, 2)
    degree = shape.degree(order)
    squares, slopes = (fx * fx, fx * fy, fy * fy), (fx * f, fy * f, fx, fy)
    terms = [(term, 2 * degree) for term in squares] + [(term, degree) for term in slopes]
    terms += [(term, 0) for term in (f * f, f, weight)]
    powers = [arms[:, 0] ** a * arms[:, 1] ** b for a, b in shape.monomials(2 * degree)]
    sums = [
        np.einsum("np,np->n", term, power)
        for term, most in terms
        for power in powers[: len(shape.monomials(most))]
    ]
    return np.stack(sums, axis=1)


def _beside(
    ref: Reference, motion: F64, valid: Mask, here: I64, lines: breaks.Lines, line: I64
) -> tuple[F64, Mask]:
    """Motion (M, 2, P) carried from the nearest valid point of the same side, where there is one.

    The fit across the break is of no use to start from: it lies between both motions.
    """
    from scipy.spatial import KDTree

    given = np.flatnonzero(valid)
    near = KDTree(ref.xy[given]).query(ref.xy[here], k=min(_NEAR, len(given)))[1]
    near = given[np.reshape(near, (len(here), -1))]
    normal, place = lines.normal[line], lines.place[line]
    own = np.einsum("mk,mk->m", ref.xy[here] - place, normal) >= 0
    theirs = np.einsum("mnk,mk->mn", ref.xy[near] - place[:, None], normal) >= 0
    same = theirs == own[:, None]
    nearest = near[np.arange(len(here)), same.argmax(axis=1)]
    start = np.zeros((len(here), *motion.shape[1:]))
    start[:, :, :3] = motion[nearest, :, :3]
    apart = ref.xy[here] - ref.xy[nearest]
    start[:, :, 0] += np.einsum("mab,mb->ma", start[:, :, 1:3], apart)
    return start, same.any(axis=1)


def _merged(
    field: DisplacementField, here: I64, measured: DisplacementField, good: Mask
) -> DisplacementField:
    """Put what was measured of one side into a field."""
    names = (
        "u", "v", "sigma_u", "sigma_v", "gradient", "sigma_gradient", "zncc", "iterations",
        "valid_fraction", "status",
    )  # fmt: skip
    arrays = {name: getattr(field, name).copy() for name in names}
    for name, into in arrays.items():
        into[here] = Status.SPLIT if name == "status" else getattr(measured, name)[good]
    return replace(field, **arrays)

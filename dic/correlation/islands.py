"""First guesses for the parts of a ROI that are too small for the templates of `seeds`.

Such a template holds more of what lies around the part than of the part, and finds the motion of
that. Here only pixels of the part count.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from dic.arrays import F32, F64, I64, U8, AnyArray, Mask
from dic.correlation import dense_motion, seeds
from dic.correlation.reference import Reference
from dic.fields.displacement import Status

_FEWEST = 80  # px of a part: fewer look like other places by accident
_SPACING = 30  # px, between the places of a part that are searched for
_REACH = 24  # px searched around what the neighbours say
_BELIEVED = 0.8  # ZNCC, for a template of few pixels finds others that are a bit like it
_APART, _BETTER = 5, 0.1  # px to another place, and the ZNCC by which it must be worse


class Islands(NamedTuple):
    """Small parts of a ROI.

    Attributes
    ----------
    labels : (H, W) int32
        The part of each pixel that is used.
    part : (N,) int32
        That of each point; 0 for points that are not in a small one.
    margin : int, px
        By which the ROI is wider than its pixels in `labels`.
    """

    labels: AnyArray
    part: AnyArray
    margin: int


def find_islands(ref: Reference) -> Islands | None:
    """Find the parts of a ROI that hold no template; None where there are none with points."""
    weight: U8 = (ref.texture[3] > 0).astype(np.uint8)
    if weight.all():
        return None
    count, labels = cv2.connectedComponents(weight, connectivity=4)
    square = np.ones((seeds.USUAL.side, seeds.USUAL.side), np.uint8)
    inner = cv2.erode(weight, square, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    pixels = np.bincount(labels.ravel(), minlength=count)
    holding = np.bincount(labels.ravel(), inner.ravel(), minlength=count)
    small = (pixels >= _FEWEST) & (holding == 0)
    columns, rows = np.rint(ref.xy).astype(np.int64).T
    part = labels[rows, columns] * (ref.status == Status.OK)
    part[~small[part]] = 0
    return Islands(labels, part, ref.margin) if part.any() else None


def search(
    ref: Reference, small: Islands, image: F32, motion: F64, known: Mask
) -> tuple[F64, Mask, Mask]:
    """Find the motion of the points of small parts, each part by its own pixels.

    Parameters
    ----------
    small : Islands
        Of the reference.
    image : (H, W) float32, grey levels
        The deformed image.
    motion : (N, 2, 3) px
        u, ∂u/∂x, ∂u/∂y and those of v, as far as it is known.
    known : (N,) bool

    Returns
    -------
    motion : (N, 2, 3)
    known : (N,) bool
    found : (N,) bool
        The points of parts that were found.
    """
    outside = known & (small.part == 0)
    around, given = dense_motion.fill(ref.xy, motion, outside)
    inside, found = np.zeros_like(motion), np.zeros(len(known), bool)
    for part in np.unique(small.part[small.part > 0]):
        here = np.flatnonzero(small.part == part)
        shifts = _search_part(ref, small, image, here, around[:, :, 0])
        if shifts is not None:
            inside[here, :, 0], found[here] = shifts, True
    if not found.any():
        return motion, known, found
    # The motion of a part is not that of what lies around it.
    rest = np.where((outside | given)[:, None, None], around, motion)
    return np.where(found[:, None, None], inside, rest), known | given | found, found


def _search_part(ref: Reference, small: Islands, image: F32, here: I64, around: F64) -> F64 | None:
    """Shifts (M, 2) px of the points `here` of a part; None where none of its places is found."""
    places, shifts = list[int](), list[F64]()
    for place in _places(ref, here):
        shift = _find(ref, small, image, place, shifts[0] if shifts else around[place])
        if shift is not None:
            places.append(place)
            shifts.append(shift)
    if not places:
        return None
    apart = np.linalg.norm(ref.xy[here, None] - ref.xy[None, places], axis=2)
    return np.array(shifts)[apart.argmin(axis=1)]


def _places(ref: Reference, here: I64) -> list[int]:
    """Of each cell of a part the point whose subset has most pixels, best first."""
    best = here[np.argsort(-ref.light[here, 2], kind="stable")]
    cell = np.floor((ref.xy[best] - ref.xy[best].min(axis=0)) / _SPACING)
    _, first = np.unique(cell @ (1.0, 1e5), return_index=True)
    return [int(place) for place in best[np.sort(first)]]


def _find(ref: Reference, small: Islands, image: F32, place: int, guess: F64) -> F64 | None:
    """Shift (2,) px of a place by the pixels of its part; None if not found, or not alone."""
    box, mask = _template(small, ref.xy[place], small.part[place])
    height, width = mask.shape
    y0, x0 = (max(int(b.start + g) - _REACH, 0) for b, g in zip(box, guess[::-1], strict=True))
    sought = image[y0 : y0 + height + 2 * _REACH, x0 : x0 + width + 2 * _REACH]
    if sought.shape[0] < height or sought.shape[1] < width:
        return None
    # What is no number has no contrast.
    scores = np.nan_to_num(
        cv2.matchTemplate(sought, ref.image[box], cv2.TM_CCOEFF_NORMED, mask=mask), posinf=0.0
    )
    j, i = np.unravel_index(int(scores.argmax()), scores.shape)
    top = float(scores[j, i])
    scores[max(j - _APART, 0) : j + _APART + 1, max(i - _APART, 0) : i + _APART + 1] = -1.0
    if top < _BELIEVED or scores.max() > top - _BETTER:
        return None
    return np.array([x0 + i - box[1].start, y0 + j - box[0].start], np.float64)


def _template(small: Islands, xy: F64, part: int) -> tuple[tuple[slice, slice], F32]:
    """Window around a place, rows and columns, and which of its pixels are of the part."""
    half = seeds.USUAL.side // 2
    column, row = np.rint(xy).astype(int)
    box = np.s_[max(row - half, 0) : row + half + 1, max(column - half, 0) : column + half + 1]
    wide = np.ones((2 * small.margin + 1, 2 * small.margin + 1), np.uint8)
    mask = cv2.dilate((small.labels[box] == part).astype(np.uint8), wide)
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    inner = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    top, left = box[0].start + int(rows[0]), box[1].start + int(columns[0])
    kept = np.asarray(mask[inner], np.float32)
    return np.s_[top : top + kept.shape[0], left : left + kept.shape[1]], kept

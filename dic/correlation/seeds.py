"""First guesses to the pixel: template matching that grows from point to point."""

from __future__ import annotations

import heapq
from typing import NamedTuple, cast

import cv2
import numpy as np

from dic.arrays import F32, F64, I64, AnyArray, Mask

_REACH = (3, 10, 24)  # px searched around what the neighbour says, then wider
_TRIES = 8  # blind searches over the whole image that may fail
_LINKS = 8  # neighbours of a seed
_PERIOD = 130  # px, the longest that is looked for
_AGAIN = 0.7  # ZNCC from which a place of the reference looks like another one
_STARTS = 4  # places that look like others before the pattern is said to repeat
_BESIDE = 3.0  # px, a neighbour farther than this from the plane of all is a false match


class Template(NamedTuple):
    """Side of what is searched for, px, and the ZNCC from which a match is believed."""

    side: int
    believed: float


USUAL = Template(41, 0.6)
"""Large enough to be unique, small enough to survive 5° of rotation."""


def wide(side: int) -> Template:
    """Template for a dim pattern: false matches score less the more pixels a template has."""
    return Template(side, USUAL.believed * USUAL.side / side)


def find(
    reference: F32, deformed: F32, xy: F64, template: Template = USUAL
) -> tuple[F64, Mask, bool]:
    """Find the motion of scattered places, most reliable first.

    The first place is searched over the whole image, every other one near its best neighbour: the
    growing of Pan 2009 (Appl. Opt. 48, 1535, reliability-guided DIC) on templates.

    Parameters
    ----------
    reference, deformed : (H, W) float32, grey levels
    xy : (S, 2), px
    template : Template

    Returns
    -------
    motion : (S, 2, 3) float64
        u, ∂u/∂x, ∂u/∂y and those of v: whole px, gradients from the neighbours.
    found : (S,) bool
    repeats : bool
        Every place from which the search could start looks like others beside it: the pattern has
        a period, and another motion is as good.
    """
    if len(xy) == 0:
        return np.zeros((0, 2, 3)), np.zeros(0, dtype=bool), False
    from scipy.spatial import KDTree

    links = KDTree(xy).query(xy, k=min(_LINKS + 1, len(xy)))[1].reshape(len(xy), -1)
    shift, found = np.zeros((len(xy), 2)), np.zeros(len(xy), dtype=bool)
    pending, missed = np.ones(len(xy), dtype=bool), 0
    centre = np.argsort(np.linalg.norm(xy - np.median(xy, axis=0), axis=1))
    whole, again = max(reference.shape), 0
    for start in centre:
        if not pending[start]:
            continue
        if missed == _TRIES:
            break
        guess = shift[found].mean(axis=0) if found.any() else np.zeros(2)
        match = _search(reference, deformed, xy[start], guess, (_REACH[-1], whole), template)
        if match[1] >= template.believed and not found.any() and _repeats(reference, xy[start]):
            again += 1
            if again == _STARTS:
                return np.zeros((len(xy), 2, 3)), found, True
        elif match[1] >= template.believed:
            shift[start], found[start], pending[start] = match[0], True, False
            state = shift, found, pending
            _grow(reference, deformed, xy, links, (start, match[1]), state, template)
        else:
            missed += 1
    return _with_gradients(xy, shift, found, links), found, not found.any() and again > 0


def _repeats(reference: F32, xy: F64) -> bool:
    """Find whether a place looks like two others, as far from it on both sides: a period.

    At half the resolution, for there a period that is no whole number of px fits as well.
    """
    reach = USUAL.side // 2 + _PERIOD
    left, top = round(xy[0]) - reach, round(xy[1]) - reach
    around = reference[max(top, 0) : top + 2 * reach + 1, max(left, 0) : left + 2 * reach + 1]
    small = cv2.resize(around, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    size = min(USUAL.side // 2, *small.shape)
    x = _within((xy[0] - max(left, 0)) / 2 - size // 2, small.shape[1] - size)
    y = _within((xy[1] - max(top, 0)) / 2 - size // 2, small.shape[0] - size)
    template = np.ascontiguousarray(small[y : y + size, x : x + size])
    scores = cv2.matchTemplate(small, template, cv2.TM_CCOEFF_NORMED)
    peaks = (scores >= _AGAIN) & (scores == cv2.dilate(scores, np.ones((5, 5), np.uint8)))
    rows, columns = np.nonzero(peaks)
    good = cv2.dilate(np.where(scores >= _AGAIN, 1, 0).astype(np.uint8), np.ones((3, 3), np.uint8))
    for j, i in zip(rows, columns, strict=True):
        across, down = 2 * x - i, 2 * y - j
        far = max(abs(i - x), abs(j - y)) > 2
        inside = 0 <= across < scores.shape[1] and 0 <= down < scores.shape[0]
        if far and (not inside or good[down, across]):
            return True
    return False


def _grow(
    reference: F32,
    deformed: F32,
    xy: F64,
    links: I64,
    start: tuple[int, float],
    state: tuple[F64, Mask, Mask],
    template: Template,
) -> None:
    """Search the neighbours of what is found, best first, writing (shift, found, pending)."""
    shift, found, pending = state
    queue = [(-start[1], start[0])]
    while queue:
        _, here = heapq.heappop(queue)
        for there in links[here]:
            if not pending[there]:
                continue
            pending[there] = False
            place, score = _search(reference, deformed, xy[there], shift[here], _REACH, template)
            if score >= template.believed:
                shift[there], found[there] = place, True
                heapq.heappush(queue, (-score, there))


def _search(
    reference: F32,
    deformed: F32,
    xy: F64,
    guess: F64,
    reaches: tuple[int, ...],
    template: Template,
) -> tuple[F64, float]:
    """Best shift (2,) px around a guess and its ZNCC, widening the search until it is believed."""
    height, width = reference.shape
    size = min(template.side, height, width)
    left = _within(xy[0] - size // 2, width - size)
    top = _within(xy[1] - size // 2, height - size)
    sought = reference[top : top + size, left : left + size]
    place, score = np.asarray(guess, dtype=np.float64), -1.0
    for reach in reaches:
        x0, x1 = (_within(left + guess[0] + side, width - size) for side in (-reach, reach))
        y0, y1 = (_within(top + guess[1] + side, height - size) for side in (-reach, reach))
        searched = deformed[y0 : y1 + size, x0 : x1 + size]
        scores = cv2.matchTemplate(searched, sought, cv2.TM_CCOEFF_NORMED)
        _, score, _, (i, j) = cv2.minMaxLoc(scores)
        place = np.array(
            [x0 + i - left + _peak(scores[j], i), y0 + j - top + _peak(scores[:, i], j)]
        )
        if score >= template.believed:
            break
    return place, score


def _within(place: float, last: int) -> int:
    return min(max(round(place), 0), last)


def _peak(scores: AnyArray, i: int) -> float:
    """Fraction of a px by which the top of a parabola lies beside the best of a line of scores."""
    if not 0 < i < len(scores) - 1:
        return 0.0
    before, here, after = (float(score) for score in scores[i - 1 : i + 2])
    return (
        (before - after) / (2 * (before - 2 * here + after)) if min(before, after) < here else 0.0
    )


def _with_gradients(xy: F64, shift: F64, found: Mask, links: I64) -> F64:
    """Motion (S, 2, 3): the gradients are those of a plane through the neighbours found."""
    motion = np.zeros((len(xy), 2, 3))
    motion[:, :, 0] = shift
    weight = (found[links] & found[:, None]).astype(np.float64)
    away, apart = xy[links] - xy[:, None], shift[links] - shift[:, None]
    spread = np.einsum("sn,sni,snj->sij", weight, away, away)
    pull = np.einsum("sn,sni,sna->sai", weight, away, apart)
    (xx, xy_), (_, yy) = spread.transpose(1, 2, 0)
    determinant = xx * yy - xy_ * xy_
    # Neighbours on a line, or fewer than three and the place itself, say nothing of a plane.
    enough = (weight.sum(axis=1) >= 4) & (determinant > 0.01 * (xx + yy) ** 2)
    slope = cast("F64", np.linalg.solve(spread[enough][:, None], pull[enough][..., None]))[..., 0]
    beside = apart[enough] - np.einsum("sai,sni->sna", slope, away[enough])
    wrong = (weight[enough][..., None] * np.abs(beside)).max(axis=(1, 2)) > _BESIDE
    motion[enough, :, 1:] = np.where(wrong[:, None, None], 0.0, slope)
    return motion

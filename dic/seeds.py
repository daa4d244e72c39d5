"""First guesses to the pixel: template matching that grows from point to point."""

from __future__ import annotations

import heapq

import cv2
import numpy as np
from numpy.typing import NDArray

_TEMPLATE = 41  # px, large enough to be unique, small enough to survive 5° of rotation
_REACH = (8, 24)  # px searched around what the neighbour says, then once more wider
_FOUND = 0.6  # ZNCC from which a match is believed
_TRIES = 12  # blind searches over the whole picture before giving up
_LINKS = 8  # neighbours of a seed


def find(
    reference: NDArray[np.float32], deformed: NDArray[np.float32], xy: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Find the motion of scattered places, most reliable first.

    The first place is searched over the whole picture, every other one near its best neighbour: the
    growing of Pan 2009 (Appl. Opt. 48, 1535, reliability-guided DIC) on templates.

    Parameters
    ----------
    reference, deformed : (H, W) float32, grey levels
    xy : (S, 2), px

    Returns
    -------
    motion : (S, 6) float64
        u, ∂u/∂x, ∂u/∂y, v, ∂v/∂x, ∂v/∂y: whole px, gradients from the neighbours.
    found : (S,) bool
    """
    if len(xy) == 0:
        return np.zeros((0, 6)), np.zeros(0, dtype=bool)
    from scipy.spatial import KDTree

    links = KDTree(xy).query(xy, k=min(_LINKS + 1, len(xy)))[1].reshape(len(xy), -1)
    shift, found = np.zeros((len(xy), 2)), np.zeros(len(xy), dtype=bool)
    pending, tries = np.ones(len(xy), dtype=bool), 0
    centre = np.argsort(np.linalg.norm(xy - np.median(xy, axis=0), axis=1))
    whole = max(reference.shape)
    for start in centre:
        if not pending[start] or (tries >= _TRIES and not found.any()):
            continue
        tries += 1
        guess = shift[found].mean(axis=0) if found.any() else np.zeros(2)
        match = _search(reference, deformed, xy[start], guess, (_REACH[1], whole))
        if match[1] >= _FOUND:
            shift[start], found[start], pending[start] = match[0], True, False
            _grow(reference, deformed, xy, links, (start, match[1]), (shift, found, pending))
    return _with_gradients(xy, shift, found, links), found


def _grow(reference, deformed, xy, links, start, state) -> None:
    """Search the neighbours of what is found, best first, writing (shift, found, pending)."""
    shift, found, pending = state
    queue = [(-start[1], start[0])]
    while queue:
        _, here = heapq.heappop(queue)
        for there in links[here]:
            if not pending[there]:
                continue
            pending[there] = False
            place, score = _search(reference, deformed, xy[there], shift[here], _REACH)
            if score >= _FOUND:
                shift[there], found[there] = place, True
                heapq.heappush(queue, (-score, there))


def _search(reference, deformed, xy, guess, reaches) -> tuple[NDArray[np.float64], float]:
    """Best shift (2,) px around a guess and its ZNCC, widening the search until it is believed."""
    height, width = reference.shape
    size = min(_TEMPLATE, height, width)
    left = int(np.clip(round(xy[0]) - size // 2, 0, width - size))
    top = int(np.clip(round(xy[1]) - size // 2, 0, height - size))
    template = reference[top : top + size, left : left + size]
    place, score = np.asarray(guess, dtype=np.float64), -1.0
    for reach in reaches:
        x0 = int(np.clip(round(left + guess[0]) - reach, 0, width - size))
        y0 = int(np.clip(round(top + guess[1]) - reach, 0, height - size))
        x1 = int(np.clip(round(left + guess[0]) + reach, 0, width - size)) + size
        y1 = int(np.clip(round(top + guess[1]) + reach, 0, height - size)) + size
        scores = cv2.matchTemplate(deformed[y0:y1, x0:x1], template, cv2.TM_CCOEFF_NORMED)
        _, score, _, best = cv2.minMaxLoc(scores)
        place = np.array([x0 + best[0] - left, y0 + best[1] - top], dtype=np.float64)
        if score >= _FOUND:
            break
    return place, score


def _with_gradients(xy, shift, found, links) -> NDArray[np.float64]:
    """Motion (S, 6): the gradients are those of a plane through the neighbours that were found."""
    motion = np.zeros((len(xy), 6))
    motion[:, [0, 3]] = shift
    for here in np.flatnonzero(found):
        near = links[here][found[links[here]]]
        if len(near) < 4:
            continue
        slopes = np.linalg.lstsq(xy[near] - xy[here], shift[near] - shift[here], rcond=0.1)[0]
        motion[here, 1:3], motion[here, 4:6] = slopes.T
    return motion

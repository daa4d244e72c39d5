"""Grids that are fine about places and grow coarse away from them.

The error of a recovered strain at a distance d from a point force is that of (element / d)⁴ and so
asks for elements in proportion to d. Lines of a grid run through the whole plate, hence each axis
is graded by itself: runs of equal elements, whose length doubles from one to the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fe.arrays import F64
from fe.elements.mesh import Mesh, borders
from fe.plate.aspect import check_aspect
from fe.plate.plate import Plate

# A run can be halved for an estimate of the error and still be recovered from.
_FEWEST = 12
# What touches and ends of a strip do to it falls off as exp(-4.2 d / b) with the distance d over
# its width b. Farther than 2 b from a touch what is left is 2e-4 of it, or smooth, and elements
# grow; an end does less, for it only holds what reaches it.
_FAR = 2.0
_FAR_FROM_ENDS = 1.0
_FAR_GROWTH = 0.6
# Borders of patches are corners of stiffness; elements beside them are not longer than b/40.
_AT_BORDERS = 40.0
_FINER = 1.25  # by which elements grow until they are few enough
_LONGEST = 1000.0  # times as long as wide, up to which plates are looked at
_LARGEST = 100_000  # elements; their factors take two gigabytes


class Grading(NamedTuple):
    """How a grid grows.

    Attributes
    ----------
    finest : float
        Elements at a place, for the shorter side.
    growth : float
        Length of an element over its distance from the next place.
    elements : int
        So many at most, where coarser elements at all places can bring them down to it.
    across : float
        Elements near places and ends of a strip, for the shorter side.
    far : float
        Up to which distance from a place, in shorter sides.
    """

    finest: float
    growth: float
    elements: int
    across: float = 6.0
    far: float = _FAR


class Spots(NamedTuple):
    """Intervals of a line that are to be resolved, and how.

    Attributes
    ----------
    low, high : (P,) float64, mm
    floor : (P,) float64, mm
        Length of the elements inside.
    growth : float
    longest : float, mm
        Length of elements up to the distances `far`, mm, from them and `from_ends`, mm.
    """

    low: F64
    high: F64
    floor: F64
    growth: float
    longest: float
    far: float
    from_ends: float


def graded(plate: Plate, xy: F64, radius: F64, grading: Grading) -> Mesh:
    """Return a mesh that resolves discs about places.

    Parameters
    ----------
    plate : Plate
    xy : (P, 2) float64, mm
        Middles of the discs.
    radius : (P,) float64, mm
        0 for points.
    grading : Grading

    Raises
    ------
    ValueError
        The plate is more than 1000 times as long as wide, or the places take too many elements.
    """
    check_aspect(plate, _LONGEST)
    scale = 1.0
    while True:
        mesh = _mesh(plate, xy, radius, scale, grading)
        elements = mesh.counts[0] * mesh.counts[1]
        if elements <= grading.elements:
            return mesh
        if scale * grading.growth > 1.0:
            break
        scale *= _FINER
    if elements > _LARGEST:
        raise ValueError(
            f"a mesh that is fine at {len(xy)} places of a plate of {plate.size[0]:g} x "
            f"{plate.size[1]:g} mm takes {elements} elements, more than {_LARGEST}; ask for fewer "
            "places at once, or give a mesh"
        )
    return mesh


def _mesh(plate: Plate, xy: F64, radius: F64, scale: float, grading: Grading) -> Mesh:
    across = min(plate.size)
    finest = np.maximum(scale * across / grading.finest, radius / _FEWEST)
    parts: list[tuple[list[float], list[int]]] = []
    for axis, places in enumerate(borders(plate)):
        low, high = (
            np.concatenate([xy[:, axis] + sign * radius, np.array(places)]) for sign in (-1, 1)
        )
        at_borders = np.full(len(places), max(scale, 1.0) * across / _AT_BORDERS)
        floor, growth = np.concatenate([finest, at_borders]), scale * grading.growth
        far = grading.far * across, _FAR_FROM_ENDS * across
        spots = Spots(low, high, floor, growth, across / grading.across, *far)
        parts.append(_runs(plate.size[axis], spots, places))
    (breaks_x, runs_x), (breaks_y, runs_y) = parts
    counts = sum(runs_x), sum(runs_y)
    breaks = tuple(breaks_x), tuple(breaks_y)
    return Mesh(plate.size, counts, breaks, (tuple(runs_x), tuple(runs_y)))


def _runs(side: float, spots: Spots, borders: Sequence[float]) -> tuple[list[float], list[int]]:
    """Return breaks along a side, mm, and the elements of each run between them."""
    shortest = float(min(spots.floor.min(initial=np.inf), spots.longest))
    ends = _candidates(side, spots, borders, shortest)
    middles = 0.5 * (ends[1:] + ends[:-1])
    level = np.floor(np.log2(_target(middles, side, spots) / shortest) + 1e-6)
    runs: list[list[float]] = np.column_stack(
        [ends[:-1], ends[1:], np.maximum(level, 0.0)]
    ).tolist()
    runs = _joined(runs, shortest, set(borders))
    counts = [_elements(high - low, shortest * 2.0**k) for low, high, k in runs]
    return [float(low) for low, _, _ in runs[1:]], counts


def _target(x: F64, side: float, spots: Spots) -> F64:
    """Longest element that places (K,) mm allow."""
    away = np.maximum(0.0, np.maximum(spots.low - x[:, None], x[:, None] - spots.high))
    near = np.maximum(spots.floor, spots.growth * away).min(axis=1, initial=np.inf)
    beyond = away.min(axis=1, initial=np.inf) - spots.far
    beyond_ends = np.minimum(x, side - x) - spots.from_ends
    far = _FAR_GROWTH * np.minimum(beyond, beyond_ends)
    return np.minimum(near, np.maximum(spots.longest, far))


def _candidates(side: float, spots: Spots, borders: Sequence[float], shortest: float) -> F64:
    """Places at which the length of elements may change, ends included."""
    doublings = shortest * 2.0 ** np.arange(1, 40)
    near = doublings[doublings <= spots.longest] / spots.growth
    grown = doublings[(doublings > spots.longest) & (doublings < _FAR_GROWTH * side)] / _FAR_GROWTH
    steps = np.concatenate([near, spots.far + grown])
    around = [spots.low[:, None] - steps, spots.high[:, None] + steps]
    ends = spots.from_ends + grown, side - spots.from_ends - grown
    both = np.concatenate([*(part.ravel() for part in around), *ends, np.array(borders)])
    inside = both[(both > 0) & (both < side)]
    return np.unique(np.concatenate([[0.0], inside, [side]]))


def _joined(runs: list[list[float]], shortest: float, fixed: set[float]) -> list[list[float]]:
    """Join neighbours of one length and refine what is too short, until no run is."""
    while True:
        kept = [runs[0]]
        for run in runs[1:]:
            if run[2] == kept[-1][2] and run[0] not in fixed:
                kept[-1][1] = run[1]
            else:
                kept.append(run)
        runs = kept
        short = [r for r in runs if r[2] > 0 and r[1] - r[0] < _FEWEST * shortest * 2.0 ** r[2]]
        if not short:
            return _swallowed(runs, shortest, fixed)
        max(short, key=lambda run: run[2])[2] -= 1


def _swallowed(runs: list[list[float]], shortest: float, fixed: set[float]) -> list[list[float]]:
    """Give runs of the shortest elements that are still too short to the run before or after."""
    while True:
        for k, (low, high, level) in enumerate(runs):
            if high - low >= 0.5 * _FEWEST * shortest * 2.0**level:
                continue
            for other in (k - 1, k + 1):
                first = min(k, other)
                if 0 <= other < len(runs) and runs[first + 1][0] not in fixed:
                    level = min(level, runs[other][2])
                    runs[first : first + 2] = [[runs[first][0], runs[first + 1][1], level]]
                    break
            else:
                continue
            break
        else:
            return runs


def _elements(length: float, longest: float) -> int:
    return max(2 * int(np.ceil(0.5 * length / longest - 1e-6)), _FEWEST)

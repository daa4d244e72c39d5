"""Speckle that moves by any displacement: spots in closed form, read where they came from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp
from typing import cast

import numpy as np
from numba import njit  # pyright: ignore[reportUnknownVariableType]

from rig.studies.correlation.images import CONTRAST, DENSITY, SPOT
from rig.system.arrays import F64, I64

Displacement = Callable[[F64, F64], tuple[F64, F64]]
"""u and v, px, of material points at x and y, px."""
Origin = Callable[[F64, F64], tuple[F64, F64]]
"""Where the material came from that now lies at x and y, px."""

_MARGIN = 30  # px around the image, from which spots move in
_REACH = 5.0  # standard deviations of a spot
_SAMPLES = -0.5 / 3**0.5, 0.5 / 3**0.5  # of a pixel along each side: Gauss, exact to degree 3
_ROUNDS = 14  # of the iteration for where material came from: 0.3 px a px leaves 1e-7 px


@dataclass(frozen=True, eq=False)
class MovedSpeckle:
    """Spots over an image (H, W), sorted into cells.

    Attributes
    ----------
    shape : (int, int), px
    spots : (3, N) float64
        x, y and height.
    first : (·,) int64
        The first spot of each cell.
    width : float, px
        Standard deviation of a spot.
    """

    shape: tuple[int, int]
    spots: F64
    first: I64
    width: float

    def draw(self, origin: Origin | None = None) -> F64:
        """Draw the image, or the one whose material came from `origin`, (H, W), grey levels."""
        y, x = np.indices(self.shape).astype(np.float64)
        total = np.zeros(self.shape)
        for dy in _SAMPLES:
            for dx in _SAMPLES:
                at = (x + dx, y + dy) if origin is None else origin(x + dx, y + dy)
                _add_spots(*at, self.spots, self.first, self.width, total)
        return 128 + total / len(_SAMPLES) ** 2


def moved_speckle(shape: tuple[int, int], seed: int = 0, width: float = SPOT) -> MovedSpeckle:
    """Scatter spots over an image and around it."""
    rng, size = np.random.default_rng(seed), np.array(shape[::-1]) + 2 * _MARGIN
    density = DENSITY * (SPOT / width) ** 2
    count = int(size.prod() * density)
    centres = rng.uniform(0, 1, (count, 2)) * size - _MARGIN
    heights = rng.choice([-1.0, 1.0], count) * CONTRAST / np.sqrt(np.pi * width**2 * density)
    cell, across = _REACH * width, _cells(shape[1], width)
    place = ((centres + _MARGIN) // cell).astype(np.int64)
    key = place[:, 1] * across + place[:, 0]
    order = np.argsort(key, kind="stable")
    first = np.searchsorted(key[order], np.arange(across * _cells(shape[0], width) + 1))
    return MovedSpeckle(shape, np.vstack([centres.T, heights])[:, order], first, width)


def came_from(displacement: Displacement) -> Origin:
    """Invert a displacement of material points: where lay what now lies at x, y."""

    def origin(x: F64, y: F64) -> tuple[F64, F64]:
        at_x, at_y = x, y
        for _ in range(_ROUNDS):
            u, v = displacement(at_x, at_y)
            at_x, at_y = x - u, y - v
        return at_x, at_y

    return origin


def _cells(length: int, width: float) -> int:
    return int((length + 2 * _MARGIN) // (_REACH * width)) + 1


def _sum_spots(x: F64, y: F64, spots: F64, first: I64, width: float, out: F64) -> None:
    cell = _REACH * width
    across = int((out.shape[1] + 2 * _MARGIN) // cell) + 1
    down = (first.shape[0] - 1) // across
    for j in range(out.shape[0]):
        for i in range(out.shape[1]):
            column, row = int((x[j, i] + _MARGIN) // cell), int((y[j, i] + _MARGIN) // cell)
            for b in range(max(row - 1, 0), min(row + 2, down)):
                for a in range(max(column - 1, 0), min(column + 2, across)):
                    for k in range(first[b * across + a], first[b * across + a + 1]):
                        away = (x[j, i] - spots[0, k]) ** 2 + (y[j, i] - spots[1, k]) ** 2
                        if away < cell * cell:
                            out[j, i] += spots[2, k] * exp(-away / (2 * width * width))


_add_spots = cast(
    "Callable[[F64, F64, F64, I64, float, F64], None]", njit(cache=True, nogil=True)(_sum_spots)
)

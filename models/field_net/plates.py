"""Displacement of random plates under random touches, as a camera sees it, on tiles."""

from __future__ import annotations

import numpy as np

from fe import Clamped, Edges, Free, Plate, Supported, Touch, deflect, grid
from models.arrays import F64

_MESH = 24
_MARGIN = 0.02  # of a side, that the tiles stay away from the edges
_KINDS = Clamped(), Supported(), Free()


def draw_plates(count: int, side: int, rng: np.random.Generator) -> list[F64]:
    """Solve random plates for what moves their image sideways.

    A pinhole camera sees a deflection w at a distance x from its axis as x w/Z. That is the larger
    part by far; its size is drawn where the fields are put together.

    Parameters
    ----------
    count : int
    side : int
        Tiles along each side of a plate.
    rng : numpy.random.Generator

    Returns
    -------
    list of (3, side, side) float64
        u, ∂u/∂x, ∂u/∂y per tile, of a largest |u| of 1.
    """
    return [_draw(side, rng) for _ in range(count)]


def _draw(side: int, rng: np.random.Generator) -> F64:
    a, b = (float(length) for length in rng.uniform(100, 250, 2))
    plate = Plate(size=(a, b), thickness=1.0, young=3000.0, poisson=0.35, edges=_edges(rng))
    touches = [
        Touch(
            *(rng.uniform(0.08, 0.92, 2) * (a, b)),
            force=rng.uniform(0.3, 1.0),
            radius=rng.uniform(2, 8),
        )
        for _ in range(int(rng.integers(1, 4)))
    ]
    state = deflect(plate, touches, grid(plate, _MESH))
    fraction = np.linspace(_MARGIN, 1 - _MARGIN, side)
    xy = np.column_stack([np.tile(fraction, side) * a, np.repeat(fraction, side) * b])
    w, slope = state.deflection(xy), state.slope(xy)
    along = rng.uniform(0, 2 * np.pi)
    turn, centre = np.array([np.cos(along), np.sin(along)]), rng.uniform(0.3, 0.7, 2) * (a, b)
    lever = (xy - centre) @ turn
    pitch = np.array([a, b]) * (1 - 2 * _MARGIN) / (side - 1)
    slopes = (turn * w[:, None] + lever[:, None] * slope) * pitch
    field = np.stack([lever * w, *slopes.T]).reshape(3, side, side)
    return field / np.abs(field[0]).max()


def _edges(rng: np.random.Generator) -> Edges:
    """Draw how the edges are held, two of them or more."""
    while True:
        west, east, south, north = (_KINDS[int(k)] for k in rng.choice(3, 4, p=(0.6, 0.25, 0.15)))
        if sum(not isinstance(kind, Free) for kind in (west, east, south, north)) >= 2:
            return Edges(west, east, south, north)

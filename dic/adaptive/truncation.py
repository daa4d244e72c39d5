"""What tiles move within themselves beyond the second derivatives by which they are read."""

from __future__ import annotations

import numpy as np

from dic.adaptive.observation import box
from dic.arrays import F64

_AROUND = 5  # tiles along the side of the square that is looked at: a short wave is as long
# Mean squares over a tile of x³/6 and x²y/2, and of the product of x³/6 and xy²/2.
_STRAIGHT, _MIXED, _BOTH = 1 / 16128, 1 / 3840, 1 / 11520
# By which an error is larger than that motion, for passes repeat it: 1.0 to 1.9 times for waves of
# 12 to 20 px, 0.3 to 0.6 px high, in any direction.
_REPEATED = 1.5
_LARGEST = np.array([1.0, np.pi, np.pi])[:, None, None]  # a tile alone, and a wave of two of them


def truncation(values: F64, kept: F64) -> F64:
    """Say how far third derivatives, by which no tile is read, put a field off.

    Parameters
    ----------
    values : (2, 3, R, C) float64
        u, ∂u/∂x, ∂u/∂y and v, ∂v/∂x, ∂v/∂y, px and px per tile, NaN where they are not known.
    kept : (2, 3, R, C) float64
        σ of these over that of a tile.

    Returns
    -------
    (2, 3, R, C) float64, px and px per tile
        One standard deviation; 0 where no third derivative is known around.

    Notes
    -----
    What a tile moves within itself, in u or v, pulls it as the pattern lies in it. That is new in
    every tile: noise, of which a field keeps as much as of any other.
    """
    moved = _beyond(values)
    kept = np.clip(np.nan_to_num(kept), 0.0, _LARGEST)
    return _REPEATED * kept * np.sqrt(moved.sum(axis=0))


def _beyond(values: F64) -> F64:
    """Mean square over the tiles around of what each moves by third derivatives, (2, R, C) px²."""
    u, right, down = values[:, 0], values[:, 1], values[:, 2]
    xxx, xxy = _third(u, right), _second_difference(down)
    yyy = _turned(_third(_turned(u), _turned(down)))
    xyy = _turned(_second_difference(_turned(right)))
    power = _STRAIGHT * (xxx**2 + yyy**2) + _MIXED * (xxy**2 + xyy**2)
    power += 2 * _BOTH * (xxx * xyy + yyy * xxy)
    return np.stack([_mean_known(each) for each in power])


def _third(u: F64, slope: F64) -> F64:
    """Third derivative along the last axis by values and slopes, right to fourth order.

    NaN at both ends.
    """
    third = np.full_like(u, np.nan)
    third[..., 1:-1] = 7.5 * (u[..., 2:] - u[..., :-2])
    third[..., 1:-1] -= 1.5 * (slope[..., 2:] + 8.0 * slope[..., 1:-1] + slope[..., :-2])
    return third


def _second_difference(slope: F64) -> F64:
    """Second derivative along the last axis of a slope across it; NaN at both ends."""
    second = np.full_like(slope, np.nan)
    second[..., 1:-1] = slope[..., 2:] - 2.0 * slope[..., 1:-1] + slope[..., :-2]
    return second


def _mean_known(plane: F64) -> F64:
    known = np.isfinite(plane)
    count = np.maximum(box(known.astype(np.float64), _AROUND), 1e-9)
    return np.maximum(box(np.where(known, plane, 0.0), _AROUND) / count, 0.0)


def _turned(plane: F64) -> F64:
    return plane.swapaxes(-1, -2)

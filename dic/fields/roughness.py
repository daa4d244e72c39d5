"""What a measured field says of its own σ: rougher than the noise, or bent within a subset."""

from __future__ import annotations

from functools import cache

import numpy as np

from dic.arrays import F64, AnyArray
from dic.fields import shape
from dic.fields.grid import Grid

_DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0])  # zero for every cubic
_STRIDE = 2  # steps
MEDIAN = 0.4549  # of χ² with one degree of freedom
_SPAN = 1.5  # subsets, over which a bend is looked at
FEWEST = 100  # differences from which a median is taken
EXACT = 1e-6  # px, images that are drawn have no noise
USUAL = 1.15  # what a pattern that is not the same everywhere makes of it, with noise alone


@cache
def overlap(order: int, subset: int, step: int, count: int) -> F64:
    """Correlate the noise of points that lie (dy, dx) steps apart, (count, count).

    Subsets that share pixels share their noise, as the fit weighs the pixels.
    """
    weights = shape.centre_weights(order, subset)
    shared = np.zeros((count, count))
    for i, dy in enumerate(range(0, min(count * step, subset), step)):
        for j, dx in enumerate(range(0, min(count * step, subset), step)):
            shared[i, j] = np.sum(weights[dy:, dx:] * weights[: subset - dy, : subset - dx])
    return shared / shared[0, 0]


@cache
def differences(order: int, subset: int, step: int) -> tuple[list[int], list[float], float]:
    """Places (steps) and weights of a fourth difference, and its variance where σ is 1."""
    place = _STRIDE * np.arange(len(_DIFFERENCE))
    apart = overlap(order, subset, step, int(place[-1]) + 1)[0]
    shared = apart[np.abs(place[:, None] - place)]
    return place.tolist(), _DIFFERENCE.tolist(), float(_DIFFERENCE @ shared @ _DIFFERENCE)


def bending(grid: Grid) -> tuple[int, float]:
    """Return the steps of second differences, and what turns them into a flattening."""
    reach = max(round(_SPAN * grid.subset / grid.step), 1)
    return reach, (grid.subset**2 - 1) / 24 / (reach * grid.step) ** 2


def excess(u: AnyArray, sigma: AnyArray, grid: Grid, order: int) -> float:
    """Compare the fourth differences of a field with what σ makes of them; 1 or more.

    What noise leaves between neighbours is known. Where a field is rougher, as under uneven light
    or blur, which change the pattern in ways that the model does not hold, σ is too small.

    Parameters
    ----------
    u, sigma : (..., N) float64, px
        Displacements on a grid, NaN where there is none.

    Returns
    -------
    float
        1 where too few points stand together.
    """
    rows = np.reshape(u, (-1, *grid.shape))
    variance = np.reshape(np.maximum(np.square(sigma), EXACT**2), (-1, *grid.shape))
    place, weights, expected = differences(order, grid.subset, grid.step)
    reach = place[-1]
    ratios: list[F64] = []
    for axis in (1, 2):
        count = rows.shape[axis] - reach
        if count < 1:
            continue
        along, power = np.moveaxis(rows, axis, 0), np.moveaxis(variance, axis, 0)
        parts = (w * along[p : p + count] for w, p in zip(weights, place, strict=True))
        difference = sum(parts, np.zeros(()))
        middle = power[reach // 2 : reach // 2 + count]
        ratios.append((np.square(difference) / (expected * middle)).ravel())
    every = np.concatenate(ratios) if ratios else np.zeros(0)
    every = every[np.isfinite(every)]
    if len(every) < FEWEST:
        return 1.0
    return max(float(np.sqrt(np.median(every) / MEDIAN)) / USUAL, 1.0)


def flattening(u: AnyArray, grid: Grid, order: int) -> F64:
    """Estimate by how much subsets flatten a field that bends, as `u` (..., N), px.

    A shift or a plane through a parabola is off in the middle by (subset² - 1)/24 ∇²u. The second
    differences reach over 1.5 subsets, where what noise makes of this is 0.13 σ at most.
    """
    if order > 1:
        return np.zeros_like(u)
    reach, scale = bending(grid)
    rows = np.reshape(u, (-1, *grid.shape))
    bend = np.zeros_like(rows)
    for axis in (1, 2):
        count = rows.shape[axis]
        if count <= 2 * reach:
            continue
        at = np.clip(np.arange(count), reach, count - 1 - reach)
        low, middle, high = (np.take(rows, at + d, axis) for d in (-reach, 0, reach))
        bend += np.nan_to_num(low - 2 * middle + high)
    return np.reshape(scale * bend, u.shape)

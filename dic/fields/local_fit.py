"""A smoother field that loses less: polynomials through the points of a window."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dic.arrays import F64, I64, U8, Mask
from dic.fields import roughness
from dic.fields.displacement import DisplacementField
from dic.fields.grid import Grid
from dic.fields.shape import monomials
from dic.fields.strain_field import MIN_FRACTION
from dic.numbers import check_type, read_integer

_DEGREES = (1, 2, 3, 4)
_SINGULAR = 1e-12  # of the normal equations: the points lie on lines


@dataclass(frozen=True)
class SmoothField:
    """Displacement smoothed over windows of points, in px; NaN where it is not `valid`.

    Attributes
    ----------
    xy : (N, 2) float64, px
    u, v : (N,) float64, px
    sigma_u, sigma_v : (N,) float64, px
    valid : (N,) bool
    gauge : int, px
        Side of the square of pixels that one value depends on.
    grid : Grid
    """

    xy: F64
    u: F64
    v: F64
    sigma_u: F64
    sigma_v: F64
    valid: Mask
    gauge: int
    grid: Grid


def smooth(disp: DisplacementField, window: int = 9, degree: int = 4) -> SmoothField:
    """Fit a polynomial whose means over the subsets are what was measured there.

    A subset of order 0 or 1 measures the mean of the displacement over its pixels. The fit undoes
    that mean, so it follows waves that the subset itself flattens, and a wide window of small
    subsets has less noise for the same loss than one subset of a higher order.

    Parameters
    ----------
    disp : DisplacementField
        On a grid, of order 0 or 1.
    window : int
        Points along the side of the window, odd. At the border of the grid it is moved inwards.
        Points that are not valid are left out; half of the window and its own point must be there.
    degree : {1, 2, 3, 4}
        Of the polynomial. 4 keeps the shortest waves, 1 has the least noise.

    Raises
    ------
    ValueError
        The points are scattered or of order 2, the degree is another, or the window is even, larger
        than the grid or too small for the degree.

    Notes
    -----
    Least squares over the points of a window, as Savitzky and Golay (Anal. Chem. 36, 1627, 1964),
    with σ from that of the points and from the pixels that their subsets share.
    """
    grid, window, degree = _check(disp, window, degree)
    members, place = _windows(grid.shape, window)
    there = disp.valid[members]
    enough = disp.valid & (there.sum(axis=1) >= MIN_FRACTION * window**2)
    kinds = np.column_stack([place[enough], np.packbits(there[enough], axis=1)])
    # Windows in which the same points are used share their weights: nearly all do.
    _, kind, counts = np.unique(kinds, axis=0, return_inverse=True, return_counts=True)
    alike = np.flatnonzero(enough)[np.argsort(kind, kind="stable")]
    out = np.full((4, len(disp.xy)), np.nan)
    for points in np.split(alike, np.cumsum(counts))[:-1]:
        used = there[points[0]]
        weights, spread = _weights(grid, window, degree, tuple(place[points[0]]), used)
        near = members[points][:, used]
        for a, (value, sigma) in enumerate(((disp.u, disp.sigma_u), (disp.v, disp.sigma_v))):
            out[a, points] = value[near] @ weights
            out[2 + a, points] = np.sqrt(((sigma[near] @ spread) * sigma[near]).sum(axis=1))
    gauge = (window - 1) * grid.step + grid.subset
    u, v, sigma_u, sigma_v = out
    return SmoothField(disp.xy, u, v, sigma_u, sigma_v, np.isfinite(u), gauge, grid)


def _check(disp: DisplacementField, window: int, degree: int) -> tuple[Grid, int, int]:
    check_type(disp, DisplacementField, "disp", "dic.correlate")
    if disp.grid is None or disp.order > 1:
        found = "scattered points" if disp.grid is None else f"order {disp.order}"
        raise ValueError(
            f"smoothing needs a grid of order 0 or 1, got {found}; prepare with order=1"
        )
    degree = read_integer(degree, "degree of the polynomial", "powers")
    if degree not in _DEGREES:
        raise ValueError(f"degree of the polynomial must be 1, 2, 3 or 4, got {degree}; use 4")
    largest = min(disp.grid.shape)
    window = read_integer(window, "smoothing window", "points")
    if window % 2 == 0 or not degree < window <= largest:
        raise ValueError(
            f"smoothing window must be odd, more than the degree {degree} and at most the "
            f"{largest} points of the grid, got {window}; use {degree // 2 * 2 + 5}"
        )
    return disp.grid, window, degree


def _windows(shape: tuple[int, int], window: int) -> tuple[I64, U8]:
    """Points of the window of each point, (N, window²), and its row and column in it, (N, 2)."""
    starts = [np.clip(np.arange(n) - window // 2, 0, n - window) for n in shape]
    rows, columns = (start[:, None] + np.arange(window) for start in starts)
    members = rows[:, None, :, None] * shape[1] + columns[None, :, None, :]
    inside = np.meshgrid(
        *(np.arange(n) - s for n, s in zip(shape, starts, strict=True)), indexing="ij"
    )
    place = np.stack(inside, axis=-1).reshape(-1, 2).astype(np.uint8)
    return members.reshape(-1, window**2), place


def _weights(
    grid: Grid, window: int, degree: int, place: tuple[int, int], used: Mask
) -> tuple[F64, F64]:
    """Weights (M,) of the M used points of a window that give its value at `place` (row, column).

    Also their products with the noise that the points have in common, (M, M). NaN where the points
    do not hold the polynomial.
    """
    line, extent = np.arange(window), window * grid.step / 2
    pixels = np.arange(grid.subset) - grid.subset // 2
    powers = np.arange(degree + 1)[:, None, None]
    down, along = (
        np.mean((((line - p) * grid.step)[:, None] + pixels) ** powers / extent**powers, axis=-1)
        for p in place
    )
    basis = np.array([np.outer(down[b], along[a]).ravel()[used] for a, b in monomials(degree)])
    y, x = (part.ravel()[used] for part in np.meshgrid(line, line, indexing="ij"))
    normal, turn = np.linalg.eigh(basis @ basis.T)
    known = normal[0] > _SINGULAR * normal[-1]
    weights = turn[0] / normal @ turn.T @ basis if known else np.full(len(x), np.nan)
    shared = roughness.overlap(1, grid.subset, grid.step, window)
    apart = np.abs(y[:, None] - y), np.abs(x[:, None] - x)
    return weights, np.outer(weights, weights) * shared[apart]

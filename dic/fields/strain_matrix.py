"""Small strain as a matrix: for a grid that is measured again and again, the fit is done once."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array

from dic.arrays import F64, I64, Mask
from dic.fields.strain_field import MIN_FRACTION, check_fits, check_window
from dic.numbers import check_array, read_real


def strain_operator(valid: Mask, step: float, window: int) -> csr_array:
    """Matrix that turns displacements on a grid into small strain.

    Parameters
    ----------
    valid : (R, C) bool
        Points that are measured.
    step : float, px
        Distance of neighbouring points.
    window : int
        Points along the side of the strain window, odd.

    Returns
    -------
    (3N, 2N) csr_array, per px, N = R·C
        Applied to (u1, v1, u2, v2, …) it gives (exx1, eyy1, exy1, …) by the least-squares plane of
        `dic.strain`; rows of points without a strain are empty.

    Raises
    ------
    ValueError
        If the window is even, less than 3 or larger than the grid, or the step is not positive.
    """
    window = check_window(window)
    check_array(valid, "valid", "b", 2)
    check_fits(window, valid.shape)
    if read_real(step, "step", "px") == 0:
        raise ValueError("step must be more than 0 px, got 0; give the distance of the points")
    slope_x, slope_y = _slopes(valid, step, window)
    count = valid.size
    point = 3 * np.arange(count)
    parts = [  # row of the strain, slope, component of the displacement, factor
        (point, slope_x, 0, 1.0),
        (point + 1, slope_y, 1, 1.0),
        (point + 2, slope_y, 0, 0.5),
        (point + 2, slope_x, 1, 0.5),
    ]
    rows: list[I64] = []
    columns: list[I64] = []
    values: list[F64] = []
    for row, slope, component, factor in parts:
        rows.append(row[slope.row])
        columns.append(2 * slope.col.astype(np.int64) + component)
        values.append(factor * slope.data)
    place = np.concatenate(rows), np.concatenate(columns)
    return coo_array((np.concatenate(values), place), shape=(3 * count, 2 * count)).tocsr()


def _slopes(valid: Mask, step: float, window: int) -> tuple[coo_array, coo_array]:
    """∂/∂x and ∂/∂y of the plane through the valid points of each window, (N, N) per px."""
    half = window // 2
    offsets = np.arange(-half, half + 1)
    there = np.lib.stride_tricks.sliding_window_view(np.pad(valid, half), (window, window))
    weight = there.reshape(-1, window * window).astype(np.float64)  # (N, window²)
    y, x = (part.ravel() * step for part in np.meshgrid(offsets, offsets, indexing="ij"))
    count = np.maximum(weight.sum(axis=1), 1)[:, None]
    x = x - (weight @ x)[:, None] / count
    y = y - (weight @ y)[:, None] / count
    xx, xy, yy = ((weight * a * b).sum(axis=1)[:, None] for a, b in ((x, x), (x, y), (y, y)))
    determinant = xx * yy - xy * xy
    enough = weight.sum(axis=1) >= max(3.0, MIN_FRACTION * window * window)
    usable = valid.ravel() & enough & (determinant[:, 0] > 1e-9 * (xx * yy)[:, 0])
    determinant = np.where(usable[:, None], determinant, 1.0)
    weight = weight * usable[:, None]
    neighbour = np.arange(valid.size)[:, None] + (
        offsets[:, None] * valid.shape[1] + offsets
    ).reshape(1, -1)
    row, column = np.nonzero(weight)
    place = row, neighbour[row, column]
    shape = valid.size, valid.size
    along_x = (weight * (yy * x - xy * y) / determinant)[row, column]
    along_y = (weight * (xx * y - xy * x) / determinant)[row, column]
    return coo_array((along_x, place), shape), coo_array((along_y, place), shape)

"""The normal equations of a subset: how it answers to motion and light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dic.displacement import Status

_FLAT = 1e-3  # least slope of a subset over the steepest, below which nothing can be solved
_RIDGE = 1e-10  # of the diagonal: a degenerate pattern inverts, and its σ is huge as it should


def local(sums: NDArray, xy: NDArray) -> NDArray[np.float64]:
    """Move the moments to each point, where x and y become ξ and η.

    Parameters
    ----------
    sums : (N, 33) float64
        As from `dic.moments`.
    xy : (N, 2) px

    Returns
    -------
    (N, 8, 6) float64
        fx², fxfy, fy² with 1, ξ, η, ξ², ξη, η²; fx f, fy f, fx, fy with 1, ξ, η; and Σf², Σf, n.
    """
    x, y = xy[:, :1], xy[:, 1:]
    s, sx, sy = sums[:, 0:7], sums[:, 7:14], sums[:, 20:27]
    local = np.zeros((len(sums), 7, 6))
    local[..., 0], local[..., 1], local[..., 2] = s, sx - x * s, sy - y * s
    s, sx, sy = s[:, :3], sx[:, :3], sy[:, :3]
    local[:, :3, 3] = sums[:, 14:17] - 2 * x * sx + x * x * s
    local[:, :3, 4] = sums[:, 27:30] - x * sy - y * sx + x * y * s
    local[:, :3, 5] = sums[:, 30:33] - 2 * y * sy + y * y * s
    light = np.zeros((len(sums), 1, 6))
    light[:, 0, :3] = sums[:, 17:20]
    return np.concatenate([local, light], axis=1)


def hessian(local: NDArray) -> NDArray[np.float64]:
    """Arrange local moments as Σ JᵀJ, (N, 8, 8) float64.

    J = (fx·(1, ξ, η), fy·(1, ξ, η), -f, -1) for the motion and the light of the subset.
    """
    products = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
    hessian = np.empty((len(local), 8, 8))
    hessian[:, 0:3, 0:3] = local[:, 0][:, products]
    hessian[:, 0:3, 3:6] = hessian[:, 3:6, 0:3] = local[:, 1][:, products]
    hessian[:, 3:6, 3:6] = local[:, 2][:, products]
    for column, (of_x, of_y) in ((6, (3, 4)), (7, (5, 6))):
        hessian[:, 0:3, column] = hessian[:, column, 0:3] = -local[:, of_x, :3]
        hessian[:, 3:6, column] = hessian[:, column, 3:6] = -local[:, of_y, :3]
    hessian[:, 6, 6] = local[:, 7, 0]
    hessian[:, 6, 7] = hessian[:, 7, 6] = local[:, 7, 1]
    hessian[:, 7, 7] = local[:, 7, 2]
    return hessian


def inverse(hessian: NDArray, status: NDArray, order: int) -> NDArray[np.float64]:
    """Invert over the unknowns of the order, (N, 8, 8); zero for what is held at zero."""
    unknowns = np.arange(8) if order == 1 else np.array([0, 3, 6, 7])
    part = hessian[:, unknowns[:, None], unknowns]
    part[status != Status.OK] = np.eye(len(unknowns))
    diagonal = np.arange(len(unknowns))
    part[:, diagonal, diagonal] *= 1 + _RIDGE
    inverse = np.zeros_like(hessian)
    inverse[:, unknowns[:, None], unknowns] = np.linalg.inv(part)
    return inverse


def least_slope(
    hessian: NDArray, pixels: NDArray, status: NDArray
) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    """Find the direction in which each pattern is least steep, and name what is FLAT.

    Returns
    -------
    slope : (N,) float64, grey levels per px
        Root mean square of ∇f in that direction.
    status : (N,) int8
    """
    xx, yy, xy = hessian[:, 0, 0], hessian[:, 3, 3], hessian[:, 0, 3]
    least = (xx + yy) / 2 - np.hypot((xx - yy) / 2, xy)
    slope = np.sqrt(np.maximum(least, 0) / np.maximum(pixels, 1))
    usable = status == Status.OK
    if not usable.any():
        return slope, status
    steepest = np.sqrt((xx + yy)[usable] / pixels[usable]).max()
    flat = usable & (slope <= _FLAT * steepest)
    return slope, np.where(flat, Status.FLAT, status).astype(np.int8)

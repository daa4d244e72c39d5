"""The reference picture, prepared once: its texture and how each subset answers to motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dic.displacement import Status
from dic.grid import Grid, grid_over
from dic.image import check_image
from dic.moments import reference_sums_at_points, reference_sums_on_grid
from dic.quality import box_sums, check_subset, lies_inside
from dic.spline import coefficients, gradient

_CLIPPED = 2 / 3  # share of a subset at black or at white from which it cannot be trusted
_FLAT = 1e-3  # least slope of a subset over the steepest, below which nothing can be solved
_LEAK = 2  # px from the edge of the ROI at which the spline keeps 7 % of a jump there
_RIDGE = 1e-10  # of the diagonal, so that a degenerate pattern inverts; its σ then is huge, as it should


@dataclass(frozen=True)
class Reference:
    """What `correlate` needs of the reference; made by `prepare`.

    Attributes
    ----------
    image : (H, W) float32, grey levels
    texture : (H, W, 4) float32
        ∂f/∂x, ∂f/∂y, f less its mean, and weight (1 in the ROI, else 0; the others are 0 there too).
    xy : (N, 2) float64, px
        Points of interest.
    inverse : (N, 8, 8) float64
        Inverse of Σ JᵀJ, J = (fx·(1, ξ, η), fy·(1, ξ, η), -f, -1): motion and light of the subset.
    light : (N, 3) float64
        Σf², Σf and the number of pixels of the subset.
    slope : (N,) float64, grey levels per px
        Root mean square of ∇f in the direction in which it is least.
    status : (N,) int8
        What is known before any frame: OK, EXCLUDED, FLAT, DARK, SATURATED or OUTSIDE.
    subset : int, px
    order : int
    grid : Grid or None
    """

    image: NDArray[np.float32]
    texture: NDArray[np.float32]
    xy: NDArray[np.float64]
    inverse: NDArray[np.float64]
    light: NDArray[np.float64]
    slope: NDArray[np.float64]
    status: NDArray[np.int8]
    subset: int
    order: int
    grid: Grid | None

    @property
    def half(self) -> int:
        """(subset - 1)/2, px."""
        return self.subset // 2


def prepare(
    image: ArrayLike,
    subset: int = 21,
    step: int = 5,
    order: int = 1,
    roi: ArrayLike | None = None,
    points: ArrayLike | None = None,
) -> Reference:
    """Prepare a reference picture for any number of frames.

    Parameters
    ----------
    image : (H, W) uint8, uint16 or float, grey levels
    subset : int, px
        Side of the square subset, odd.
    step : int, px
        Distance of the points of the grid, which covers the picture wherever a whole subset fits.
    order : {0, 1}
        Shape function: 0 a shift, 1 affine.
    roi : (H, W) bool, optional
        Pixels that may be used. Points whose centre lies outside are EXCLUDED; of the other subsets
        only the pixels inside count.
    points : (N, 2), px, optional
        Measure at these points (x, y) in place of a grid.

    Raises
    ------
    ValueError
        One sentence on what cannot be used.
    """
    image = check_image(image, "reference")
    check_subset(subset, image.shape)
    if step < 1:
        raise ValueError(f"step must be at least 1 px, got {step} px; a quarter of the subset is usual")
    if order not in (0, 1):
        raise ValueError(f"order of the shape function must be 0 or 1, got {order}; use order=1")
    if image.min() == image.max():
        raise ValueError(
            f"reference image is blank (grey level {image.min():g} everywhere); "
            "it needs a pattern to follow"
        )
    weight = _weight(roi, image.shape)
    grid = grid_over(image.shape, subset, step) if points is None else None
    xy = grid.xy if grid is not None else _points(points, image.shape)
    centres = np.rint(xy).astype(np.int64)

    status = _status(image, weight, centres, subset // 2)
    texture = _texture(image, _inner(weight))
    sums = _sums(texture, centres, status, subset // 2, grid)
    hessian = _hessian(_local(sums, xy))
    slope, status = _least_slope(hessian, sums[:, 19], status)
    return Reference(
        image=image.astype(np.float32),
        texture=texture,
        xy=xy,
        inverse=_inverse(hessian, status, order),
        light=sums[:, 17:20].copy(),
        slope=slope,
        status=status,
        subset=subset,
        order=order,
        grid=grid,
    )


def _weight(roi: ArrayLike | None, shape: tuple[int, int]) -> NDArray[np.bool_]:
    if roi is None:
        return np.ones(shape, dtype=bool)
    roi = np.asarray(roi)
    if roi.shape != shape:
        raise ValueError(
            f"roi has shape {roi.shape}, the picture {shape}; give one value (H, W) for each pixel"
        )
    roi = roi.astype(bool)
    if not roi.any():
        raise ValueError("roi leaves no pixel of the picture; set those to be used to True")
    return roi


def _inner(weight: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels of the ROI on which what lies beyond it has no effect through the spline."""
    if weight.all():
        return weight
    from scipy.ndimage import binary_erosion

    square = np.ones((2 * _LEAK + 1, 2 * _LEAK + 1), dtype=bool)
    return binary_erosion(weight, square, border_value=1)


def _points(points: ArrayLike | None, shape: tuple[int, int]) -> NDArray[np.float64]:
    xy = np.array(points, dtype=np.float64)
    if xy.ndim != 2 or xy.shape[1] != 2 or len(xy) == 0:
        raise ValueError(f"points must be (N, 2) in px, ordered (x, y), got shape {xy.shape}")
    height, width = shape
    off = ~((xy >= 0) & (xy <= (width - 1, height - 1))).all(axis=1)
    if off.any():
        x, y = xy[off][0]
        raise ValueError(
            f"point ({x:g}, {y:g}) px lies outside the picture of {width}x{height} px; "
            "points are ordered (x, y)"
        )
    return xy


def _texture(image: NDArray, weight: NDArray[np.bool_]) -> NDArray[np.float32]:
    grey = image - image.mean(dtype=np.float64)
    return np.stack([*gradient(coefficients(grey)), grey, weight], axis=-1, dtype=np.float32) * (
        weight[..., None].astype(np.float32)
    )


def _status(
    image: NDArray, weight: NDArray[np.bool_], centres: NDArray[np.int64], half: int
) -> NDArray[np.int8]:
    status = np.zeros(len(centres), dtype=np.int8)
    inside = lies_inside(centres, half, image.shape)
    kept = centres[inside]
    found = np.zeros(len(kept), dtype=np.int8)
    area = (2 * half + 1) ** 2
    if np.issubdtype(image.dtype, np.integer):  # the range of a float picture is not known
        for level, name in ((0, Status.DARK), (_white(image), Status.SATURATED)):
            found[box_sums(image == level, kept, half) > _CLIPPED * area] = name
    found[box_sums(weight, kept, half) < area / 2] = Status.EXCLUDED
    status[inside], status[~inside] = found, Status.OUTSIDE
    status[~weight[centres[:, 1], centres[:, 0]]] = Status.EXCLUDED
    return status


def _white(image: NDArray) -> int:
    """Grey level at which the sensor clips: 10, 12 and 14 bit cameras also write uint16."""
    brightest = int(image.max())
    return next((2**b - 1 for b in (8, 10, 12, 14) if brightest == 2**b - 1), 2**16 - 1)


def _sums(
    texture: NDArray, centres: NDArray, status: NDArray, half: int, grid: Grid | None
) -> NDArray[np.float64]:
    if grid is not None:
        return reference_sums_on_grid(texture, grid.xs, grid.ys, half)
    inside = status != Status.OUTSIDE
    found = reference_sums_at_points(texture, centres[inside], half)
    sums = np.zeros((len(centres), found.shape[1]))
    sums[inside] = found
    return sums


def _local(sums: NDArray, xy: NDArray) -> NDArray[np.float64]:
    """Move the moments of (fx², fxfy, fy²) and (fx f, fy f, fx, fy) to each point.

    Returns
    -------
    (N, 7, 6): 1, ξ, η, ξ², ξη, η² of each; the last three only of the first three.
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


def _hessian(local: NDArray) -> NDArray[np.float64]:
    """Σ JᵀJ (N, 8, 8) from local moments."""
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


def _inverse(hessian: NDArray, status: NDArray, order: int) -> NDArray[np.float64]:
    """Inverse of the Hessian over the unknowns of the order; zero for what is held at zero."""
    unknowns = np.arange(8) if order == 1 else np.array([0, 3, 6, 7])
    part = hessian[:, unknowns[:, None], unknowns]
    part[status != Status.OK] = np.eye(len(unknowns))
    diagonal = np.arange(len(unknowns))
    part[:, diagonal, diagonal] *= 1 + _RIDGE
    inverse = np.zeros_like(hessian)
    inverse[:, unknowns[:, None], unknowns] = np.linalg.inv(part)
    return inverse


def _least_slope(
    hessian: NDArray, pixels: NDArray, status: NDArray
) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    xx, yy, xy = hessian[:, 0, 0], hessian[:, 3, 3], hessian[:, 0, 3]
    least = (xx + yy) / 2 - np.hypot((xx - yy) / 2, xy)
    slope = np.sqrt(np.maximum(least, 0) / np.maximum(pixels, 1))
    usable = status == Status.OK
    if not usable.any():
        return slope, status
    steepest = np.sqrt((xx + yy)[usable] / pixels[usable]).max()
    flat = usable & (slope <= _FLAT * steepest)
    return slope, np.where(flat, Status.FLAT, status).astype(np.int8)

"""What `dic.prepare` is asked for, checked: each refusal is one sentence."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dic.fields.grid import Grid
from dic.fields.shape import ORDERS
from dic.images.quality import check_subset


def check_options(image: NDArray, subset: int, step: int, order: int) -> None:
    """Refuse a subset, step, order or blank picture that cannot be used."""
    check_subset(subset, image.shape)
    if step < 1:
        raise ValueError(
            f"step must be at least 1 px, got {step} px; a quarter of the subset is usual"
        )
    if order not in ORDERS:
        raise ValueError(f"order of the shape function must be 0, 1 or 2, got {order}; use order=1")
    if image.min() == image.max():
        raise ValueError(
            f"reference image is blank (grey level {image.min():g} everywhere); "
            "it needs a pattern to follow"
        )


def check_served(device: str, grid: Grid | None) -> None:
    """Refuse a device that is not there, or for scattered points."""
    from dic.correlation.device_moments import check_device

    if grid is None:
        raise ValueError(f"device {device!r} serves a grid; leave it out for scattered points")
    check_device(device)


def read_roi(roi: ArrayLike | None, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Read the ROI: (H, W) bool, all of the picture if there is none."""
    if roi is None:
        return np.ones(shape, dtype=bool)
    roi = np.asarray(roi, dtype=bool)
    if roi.shape != shape:
        raise ValueError(
            f"roi has shape {roi.shape}, the picture {shape}; give one value (H, W) for each pixel"
        )
    if not roi.any():
        raise ValueError("roi leaves no pixel of the picture; set those to be used to True")
    return roi


def read_grid(points: ArrayLike | Grid, subset: int, step: int) -> Grid | None:
    """Tell whether the points are a grid, and refuse one of another subset or step."""
    if not isinstance(points, Grid):
        return None
    if (points.subset, points.step) != (subset, step):
        raise ValueError(
            f"grid is laid for subset {points.subset} px and step {points.step} px, got {subset} "
            f"and {step} px; give both the same"
        )
    for line in (points.xs, points.ys):
        if not np.issubdtype(line.dtype, np.integer) or np.any(np.diff(line) != step):
            raise ValueError(f"lines of the grid must be whole px, {step} px apart, got {line[:3]}")
    return points


def read_points(points: object, shape: tuple[int, int]) -> NDArray[np.float64]:
    """Read points (N, 2) px that lie on the picture (H, W)."""
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

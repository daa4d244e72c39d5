"""What `dic.prepare` is asked for, checked: each refusal is one sentence."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dic import numbers
from dic.arrays import F64, Mask
from dic.fields.grid import Grid
from dic.fields.shape import ORDERS
from dic.images.quality import check_subset
from dic.numbers import check_array, check_type, read_integer, shown


def check_options(
    shape: tuple[int, ...], subset: int, step: int, order: int
) -> tuple[int, int, int]:
    """Return subset, step and order; ValueError if one cannot be used on an image (H, W)."""
    subset, step = check_subset(subset, shape), read_integer(step, "step", "px")
    order = read_integer(order, "order of the shape function", "degrees")
    if step < 1:
        raise ValueError(
            f"step must be at least 1 px, got {step} px; a quarter of the subset is usual"
        )
    if order not in ORDERS:
        raise ValueError(f"order of the shape function must be 0, 1 or 2, got {order}; use order=1")
    return subset, step, order


def check_served(device: str, grid: Grid | None) -> None:
    """Refuse a device that is not there, or for scattered points."""
    from dic.correlation.device_reference import check_device

    check_type(device, str, "device", "its name, such as 'cuda'")
    if grid is None:
        raise ValueError(f"device {device!r} serves a grid; leave it out for scattered points")
    check_device(device)


def read_roi(roi: ArrayLike | None, shape: tuple[int, int]) -> Mask:
    """Read the ROI: (H, W) bool, all of the image if there is none."""
    if roi is None:
        return np.ones(shape, dtype=bool)
    try:
        mask = np.asarray(roi)
    except (ValueError, TypeError):  # such as lists of different lengths
        mask = np.zeros(0)
    if mask.dtype.kind not in "biu" or mask.shape != shape:
        raise ValueError(
            f"roi has shape {mask.shape} and type {mask.dtype}, the image {shape}; "
            "give one bool (H, W) for each pixel"
        )
    if not mask.any():
        raise ValueError("roi leaves no pixel of the image; set those to be used to True")
    return mask.astype(np.bool_)


def read_grid(points: ArrayLike | Grid, subset: int, step: int) -> Grid | None:
    """Return the points if they are a grid, and refuse one of another subset or step."""
    if not isinstance(points, Grid):
        return None
    if (points.subset, points.step) != (subset, step):
        raise ValueError(
            f"grid is laid for subset {points.subset} px and step {points.step} px, got {subset} "
            f"and {step} px; give both the same"
        )
    for line in (points.xs, points.ys):
        check_array(line, "a line of the grid", "biuf", 1)
        if not np.issubdtype(line.dtype, np.integer) or np.any(np.diff(line) != step):
            raise ValueError(
                f"lines of the grid must be whole px, {step} px apart, got {shown(line)}; "
                "lay them by numpy.arange"
            )
    return points


def read_points(points: object, shape: tuple[int, int]) -> F64:
    """Read points (N, 2) px that lie on the image (H, W)."""
    xy = numbers.read_points(points, "points")
    height, width = shape
    off = ~((xy >= 0) & (xy <= (width - 1, height - 1))).all(axis=1)
    if off.any():
        x, y = xy[off][0]
        raise ValueError(
            f"point ({x:g}, {y:g}) px lies outside the image of {width}x{height} px; "
            "points are ordered (x, y)"
        )
    return xy

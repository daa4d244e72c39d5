"""Quality of a speckle pattern, before anything is correlated."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import F64, I64, AnyArray, Mask
from dic.images.image import check_reference
from dic.images.spline import prefilter, spline_gradient
from dic.numbers import (
    check_array,
    read_array,
    read_integer,
    read_pixels,
    read_points,
    read_shape,
)


def sssig(image: ArrayLike, subset: int, xy: ArrayLike) -> F64:
    """Sum of squared subset intensity gradients.

    Parameters
    ----------
    image : (H, W), grey levels
    subset : int, px
        Odd.
    xy : (N, 2), px
        Centres, rounded to pixels.

    Returns
    -------
    (N, 2) float64, (grey levels per px)²
        Σ(∂f/∂x)² and Σ(∂f/∂y)² of each subset.

    Raises
    ------
    ValueError
        The image cannot be used, or a subset does not lie on it.

    References
    ----------
    Pan, Xie, Wang, Qian, Wang 2008, Study on subset size selection in DIC, Opt. Express 16, 7037.
    """
    grey = check_reference(image)
    subset = check_subset(subset, grey.shape)
    half = subset // 2
    places = np.rint(read_points(xy, "xy"))
    outside = ~lies_inside(places, half, grey.shape)
    if outside.any():
        x, y = places[outside][0]
        raise ValueError(
            f"the subset of {subset} px at ({x:g}, {y:g}) px leaves the image; "
            f"keep {half} px from its border"
        )
    centres = places.astype(np.int64)
    gx, gy = spline_gradient(prefilter(grey))
    return np.stack([box_sums(np.square(g), centres, half) for g in (gx, gy)], axis=1)


def noise_floor(sigma: ArrayLike, sssig: ArrayLike) -> F64:
    """Least standard deviation of a displacement, √2 σ/√SSSIG, px.

    Parameters
    ----------
    sigma : float or array, grey levels
        Standard deviation of the noise in each of the two images.
    sssig : array, (grey levels per px)²
        As from :func:`sssig`; a full Hessian in its place gives the floor with cross terms.
    """
    noise = read_array(sigma, "sigma", "grey levels")
    texture = read_array(sssig, "sssig", "(grey levels per px)²", np.inf)
    if np.any(noise < 0) or np.any(texture <= 0):
        raise ValueError("sigma must be 0 or more and sssig positive; leave out flat subsets")
    if noise.ndim and texture.ndim and noise.shape != texture.shape:
        raise ValueError(
            f"sigma has shape {noise.shape} and sssig {texture.shape}; give one sigma, or as many"
        )
    return np.sqrt(2) * noise / np.sqrt(texture)


def check_subset(subset: int, shape: tuple[int, ...]) -> int:
    """Return `subset`; ValueError unless it is odd, 5 px or more and fits into the image (H, W)."""
    subset = read_integer(subset, "subset size", "px")
    if subset % 2 == 0:
        raise ValueError(
            f"subset size must be odd, got {subset} px; use {subset - 1} or {subset + 1}"
        )
    if subset < 5:
        raise ValueError(f"subset size must be at least 5 px, got {subset} px; 15 to 41 is usual")
    if subset > min(shape):
        raise ValueError(
            f"subset of {subset} px is larger than the image of {shape[1]}x{shape[0]} px; "
            f"use at most {(min(shape) - 1) // 2 * 2 + 1}"
        )
    return subset


def lies_inside(centres: ArrayLike, half: int, shape: tuple[int, ...]) -> Mask:
    """Find where a square of ±`half` px around a centre (x, y) lies on the image, (N,) bool."""
    xy, half = read_points(centres, "centres"), read_integer(half, "half", "px")
    height, width = read_shape(shape, "shape")
    room = np.array([width - 1 - half, height - 1 - half])
    return np.all((xy >= half) & (xy <= room), axis=1)


def box_sums(plane: AnyArray, centres: I64, half: int) -> F64:
    """Sum a plane (H, W) over squares of ±`half` px around centres (N, 2), as far as it reaches.

    Raises
    ------
    ValueError
        The plane is not two-dimensional or not real, or the centres are no integers.
    """
    import cv2

    half = read_integer(half, "half", "px")
    plane, pixels = check_array(plane, "plane", "biuf", 2), read_pixels(centres, "centres")
    flat = plane.view(np.uint8) if plane.dtype == np.bool_ else plane
    if flat.dtype.char not in "Bfd":  # uint8, float32, float64
        flat = flat.astype(np.float64)
    total = np.asarray(cv2.integral(flat, sdepth=cv2.CV_64F), dtype=np.float64)
    (left, top), (right, bottom) = _ends(pixels, half, plane.shape)
    with np.errstate(invalid="ignore"):  # of infinite numbers
        return total[bottom, right] - total[bottom, left] - total[top, right] + total[top, left]


def box_areas(centres: I64, half: int, shape: tuple[int, int]) -> I64:
    """Count the pixels of an image (H, W) in squares of ±`half` px around centres (N, 2)."""
    start, stop = _ends(centres, half, shape)
    return (stop - start).prod(axis=0)


def _ends(centres: I64, half: int, shape: tuple[int, ...]) -> tuple[I64, I64]:
    """First column and row (2, N) of squares, and those behind their last, on the image."""
    size = shape[::-1]
    return np.clip(centres - half, 0, size).T, np.clip(centres + half + 1, 0, size).T

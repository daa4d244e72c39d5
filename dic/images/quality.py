"""Quality of a speckle pattern, before anything is correlated."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dic.images.image import check_image
from dic.images.spline import spline_coefficients, spline_gradient


def sssig(image: ArrayLike, subset: int, xy: ArrayLike) -> NDArray[np.float64]:
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
        The picture cannot be used, or a subset does not lie on it.

    References
    ----------
    Pan, Xie, Wang, Qian, Wang 2008, Study on subset size selection in DIC, Opt. Express 16, 7037.
    """
    image = check_image(image, "reference")
    check_subset(subset, image.shape)
    half = subset // 2
    centres = np.rint(np.atleast_2d(np.asarray(xy, dtype=np.float64))).astype(np.int64)
    outside = ~lies_inside(centres, half, image.shape)
    if outside.any():
        x, y = centres[outside][0]
        raise ValueError(
            f"the subset of {subset} px at ({x}, {y}) px leaves the picture; "
            f"keep {half} px from its border"
        )
    gx, gy = spline_gradient(spline_coefficients(image))
    return np.stack([box_sums(np.square(g), centres, half) for g in (gx, gy)], axis=1)


def noise_floor(sigma: ArrayLike, sssig: ArrayLike) -> NDArray[np.float64]:
    """Least standard deviation of a displacement, √2 σ/√SSSIG, px.

    Parameters
    ----------
    sigma : float or array, grey levels
        Standard deviation of the noise in each of the two pictures.
    sssig : array, (grey levels per px)²
        As from :func:`sssig`; a full Hessian in its place gives the floor with cross terms.
    """
    return np.sqrt(2) * np.asarray(sigma) / np.sqrt(np.asarray(sssig, dtype=np.float64))


def check_subset(subset: int, shape: tuple[int, int]) -> None:
    """Raise ValueError unless `subset` is odd, at least 5 px and fits into the picture (H, W)."""
    if subset % 2 == 0:
        raise ValueError(
            f"subset size must be odd, got {subset} px; use {subset - 1} or {subset + 1}"
        )
    if subset < 5:
        raise ValueError(f"subset size must be at least 5 px, got {subset} px; 15 to 41 is usual")
    if subset > min(shape):
        raise ValueError(
            f"subset of {subset} px is larger than the picture of {shape[1]}x{shape[0]} px; "
            f"use at most {(min(shape) - 1) // 2 * 2 + 1}"
        )


def lies_inside(centres: NDArray[np.int64], half: int, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Tell where a square of ±`half` px around a centre (x, y) lies on the picture, (N,) bool."""
    room = np.array([shape[1] - 1 - half, shape[0] - 1 - half])
    return np.all((centres >= half) & (centres <= room), axis=1)


def box_sums(plane: NDArray, centres: NDArray[np.int64], half: int) -> NDArray[np.float64]:
    """Sum a plane (H, W) over squares of ±`half` px around centres (N, 2), as far as it reaches."""
    import cv2

    plane = plane.view(np.uint8) if plane.dtype == bool else plane
    total = np.asarray(cv2.integral(plane, sdepth=cv2.CV_64F), dtype=np.float64)
    (left, top), (right, bottom) = _ends(centres, half, plane.shape)
    return total[bottom, right] - total[bottom, left] - total[top, right] + total[top, left]


def box_areas(centres: NDArray[np.int64], half: int, shape: tuple[int, int]) -> NDArray[np.int64]:
    """Count the pixels of a picture (H, W) in squares of ±`half` px around centres (N, 2)."""
    start, stop = _ends(centres, half, shape)
    return (stop - start).prod(axis=0)


def _ends(
    centres: NDArray[np.int64], half: int, shape: tuple[int, ...]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First column and row (2, N) of squares, and those behind their last, on the picture."""
    size = shape[::-1]
    return np.clip(centres - half, 0, size).T, np.clip(centres + half + 1, 0, size).T

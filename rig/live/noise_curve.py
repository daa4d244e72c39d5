"""Noise of a camera by grey level, and what each tile of an image tells of motion by it.

Light is noisier than dark, and gamma bends that: under uneven light tiles differ in their noise,
and the edges of speckles, which tell of motion, in theirs from that of the mean pixel.
"""

from __future__ import annotations

import numpy as np

from dic import Tiles
from rig.system.arrays import F32, F64

COUNT = 17
"""Grey levels at which the variance is measured."""
_FEWEST = 1000  # values from which a variance is known to 4 %


def grey_levels(image: F32) -> F64:
    """Grey levels (17,) over the bits that an image (H, W) takes, eight at least."""
    bits = max(8, int(float(image.max())).bit_length())
    return np.linspace(0.0, 2.0**bits, COUNT)


def noise_curve(mean: F32, squares: F32, values: int, floor: float) -> F64:
    """Measure the variance of images of one scene by their grey level, (17,) grey levels².

    It is that at the nearest level where too few pixels tell it.

    Parameters
    ----------
    mean : (H, W) float32
        Of the images.
    squares : (H, W) float32
        Sum of squares about it.
    values : int
        Degrees of freedom of each pixel.
    floor : float, grey levels²
        Smaller variances count as this.
    """
    levels = grey_levels(mean)
    nearest = np.clip(np.rint(mean / levels[1]), 0, COUNT - 1).astype(np.int64).ravel()
    pixels = np.bincount(nearest, minlength=COUNT)
    total = np.bincount(nearest, squares.ravel(), COUNT)
    known = values * pixels >= min(_FEWEST, values * pixels.max())
    variance = total[known] / (values * pixels[known])
    return np.maximum(np.interp(levels, levels[known], variance), floor)


def tile_weights(image: F32, noise: float, curve: F64 | None, tiles: Tiles) -> F64:
    """Weight of the motion that each tile shows, by the noise where the image is steep, (T,).

    Parameters
    ----------
    image : (H, W) float32
    noise : float, grey levels
        That counts for all tiles, whose weight is 1 where their own is as large.
    curve : (17,) float64, grey levels², optional
        Of `noise_curve`.
    tiles : Tiles
    """
    if curve is None:
        return np.ones(tiles.shape[0] * tiles.shape[1])
    down, along = np.gradient(image)
    steep = np.asarray(down**2 + along**2, dtype=np.float64)
    there = np.asarray(tiles.sums(steep), dtype=np.float64)
    variance = np.asarray(
        tiles.sums(steep * np.interp(image, grey_levels(image), curve)), dtype=np.float64
    )
    return np.divide(noise**2 * there, variance, out=np.ones(len(there)), where=variance > 0)

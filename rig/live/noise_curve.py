"""Noise of a camera by grey level, and what each tile of an image tells of motion by it.

Light is noisier than dark, and gamma bends that: under uneven light tiles differ in their noise,
and the edges of speckles, which tell of motion, in theirs from that of the mean pixel.
"""

from __future__ import annotations

import numpy as np

from dic import Tiles
from rig.system.arrays import F32, F64

LEVELS = np.linspace(0.0, 256.0, 17)
"""Grey levels at which the variance is measured."""
_FEWEST = 1000  # values from which a variance is known to 4 %
_STEP = float(LEVELS[1])


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
    nearest = np.clip(np.rint(mean / _STEP), 0, len(LEVELS) - 1).astype(np.int64).ravel()
    pixels = np.bincount(nearest, minlength=len(LEVELS))
    total = np.bincount(nearest, squares.ravel(), len(LEVELS))
    known = values * pixels >= min(_FEWEST, values * pixels.max())
    variance = total[known] / (values * pixels[known])
    return np.maximum(np.interp(LEVELS, LEVELS[known], variance), floor)


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
    variance = np.asarray(tiles.sums(steep * np.interp(image, LEVELS, curve)), dtype=np.float64)
    return np.divide(noise**2 * there, variance, out=np.ones(len(there)), where=variance > 0)

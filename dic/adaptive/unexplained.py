"""What tiles leave over beyond noise: the motion within them that no pass has found."""

from __future__ import annotations

import cv2
import numpy as np

from dic.adaptive.observation import box
from dic.adaptive.tile_lattice import TILE
from dic.arrays import F32, F64, Mask

_AROUND = 5  # tiles along the side of the square that is looked at
_FAR = 16  # tiles along the side of the blocks that say what noise is there
_QUIET = 0.1  # fraction of the tiles of a block that no motion is left in, at least
_QUANTILE = 1.28  # standard deviations below the mean at which that fraction of noise lies
_SURE = 7.0  # standard deviations of a median, above which it is more than noise: textures vary
_MEDIAN = 1.25  # standard deviations of a median over those of a mean
_WIDEST = 0.4  # relative standard deviation of a median, beyond which nothing is known of noise


def unexplained_variance(variance: F64, known: Mask, prefilter: float) -> F64:
    """Find what is left of each tile beyond the noise of the quietest tiles around.

    Parameters
    ----------
    variance : (R, C) float64, grey levels²
        A pixel, that the own motion of each tile leaves.
    known : (R, C) bool
        Tiles that are seen: none without pattern, hidden or cut by a crack.
    prefilter : float, px
        Standard deviation of the Gaussian that both images passed: it correlates the noise.

    Returns
    -------
    (R, C) float64, grey levels²
        0 where it is not more than noise for certain. That is asked of the median of the tiles
        around, which a line of hidden ones does not lift; how much it is, of their mean.
    """
    if not known.any():
        return np.zeros_like(variance)
    usual = np.median(variance[known])
    filled = np.where(known, variance, usual).astype(np.float32)
    around = np.asarray(cv2.medianBlur(filled, _AROUND), np.float64)
    spread = _spread(prefilter)
    noise = _quiet(np.asarray(around, np.float32)) / (1 - _QUANTILE * spread)
    more = np.asarray(around > (1 + _SURE * spread) * noise, np.uint8)
    if not more.any():
        return np.zeros_like(variance)
    near = np.asarray(cv2.dilate(more, np.ones((_AROUND, _AROUND), np.uint8)) > 0)
    mean = box(np.where(known, variance, 0.0), _AROUND)
    mean /= np.maximum(box(known.astype(np.float64), _AROUND), 1e-9)
    return np.where(near, np.maximum(mean - noise, 0.0), 0.0)


def _spread(prefilter: float) -> float:
    """Relative standard deviation that noise alone gives the median of the tiles around."""
    alike = max(1.0, 2 * np.pi * prefilter**2)  # pixels whose squares are one, of a Gaussian
    pixels = (TILE**2 - 2) * _AROUND**2 / alike
    return min(_MEDIAN * float(np.sqrt(2 / pixels)), _WIDEST)


def _quiet(variance: F32) -> F64:
    """Low quantile of each block of tiles, interpolated between their middles, (R, C)."""
    rows, columns = variance.shape
    count = max(rows // _FAR, 1), max(columns // _FAR, 1)
    blocks = np.empty(count, np.float32)
    for i, band in enumerate(np.array_split(variance, count[0], axis=0)):
        for j, block in enumerate(np.array_split(band, count[1], axis=1)):
            blocks[i, j] = np.quantile(block, _QUIET)
    return np.asarray(cv2.resize(blocks, (columns, rows), interpolation=cv2.INTER_LINEAR), float)

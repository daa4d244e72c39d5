"""Blocks of a subset, over which Σ ∇f n is summed to see how the noise n is correlated."""

from __future__ import annotations

from functools import cache

import numpy as np

from dic.arrays import F32, F64
from dic.compiled import njit
from dic.fields.shape import monomials
from dic.images.prefilter import gaussian_power, smooth_image

_BLOCK = 7  # px, larger than the speckles that still need no prefilter
_CROP = 256  # px of the reference in which its own blocks are summed


def block_count(subset: int) -> int:
    """Count the blocks along one side of a subset."""
    return max(3, round(subset / _BLOCK))


def expected_gain(texture: F32, noise_gain: F64, order: int, subset: int, sigma: float) -> F64:
    """Expect Σ(Σ ∇f r)² over blocks, over σ² Σ∇f², of noise that a prefilter passed, (2,).

    Parameters
    ----------
    texture : (4, H, W) float32
    noise_gain : (N, 2) float64
        What the prefilter makes of the variance of whole subsets.
    order, subset : int
    sigma : float, px
        Of the prefilter; 0 for white noise.
    """
    lost = _lost_to_fit(order, subset)
    if not sigma or not len(noise_gain):
        return np.full(2, 1 - lost)
    return _within_blocks(texture, sigma) - lost * noise_gain.mean(axis=0)


@njit(cache=True, nogil=True, error_model="numpy")
def sum_blocks(pixels: F32, r: F32, side: int, variance: float, sums: F64, out: F64) -> None:
    """Write Σ(Σ ∂f r)² over the blocks of a subset, over σ² Σ(∂f)², for x and y into `out` (2,).

    Parameters
    ----------
    pixels : (4, pixels) float32
    r : (pixels,) float32
        What the fit leaves over, of the variance σ²; NaN is written where that is not above 0.
    side : int, px
    sums : (2, B, B) float64
        Scratch: the sums over the B blocks a side.
    """
    for a in range(2):
        squares = _sum_by_block(pixels[a], r, side, sums[a])
        usual = variance * squares
        out[a] = np.sum(sums[a] ** 2) / usual if usual > 0 else np.nan


@cache
def _lost_to_fit(order: int, subset: int) -> float:
    """Fraction of the sums over blocks that the fit of a shape function takes."""
    count, arm = block_count(subset), np.arange(subset) - float(subset // 2)
    cell = np.arange(subset) * count // subset
    place = (cell[:, None] * count + cell).ravel()
    terms = np.stack([np.outer(arm**b, arm**a).ravel() for a, b in monomials(order)])
    sums = np.stack([np.bincount(place, term, count * count) for term in terms])
    return float(np.sum(sums * np.linalg.solve(terms @ terms.T, sums)) / subset**2)


def _within_blocks(texture: F32, sigma: float) -> F64:
    """Variance of Σ ∇f n over single blocks, over that of white noise, (2,).

    Blocks of one colour of a board of four lie so far apart that the filter does not mix them.
    """
    height, width = texture.shape[1:]
    top, left = max((height - _CROP) // 2, 0), max((width - _CROP) // 2, 0)
    slopes = texture[:2, top : top + _CROP, left : left + _CROP]
    rows, columns = (cell // _BLOCK % 2 for cell in np.indices(slopes.shape[1:]))
    total = np.zeros(2)
    for row in (0, 1):
        for column in (0, 1):
            mask = (rows == row) & (columns == column)
            spread = [smooth_image(slope * mask, sigma) for slope in slopes]
            total += np.sum(np.square(spread), axis=(1, 2), dtype=np.float64)
    plain = np.sum(np.square(slopes), axis=(1, 2), dtype=np.float64)
    return total / np.maximum(plain, 1e-30) / gaussian_power(sigma)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _sum_by_block(slope: F32, r: F32, side: int, sums: F64) -> float:
    """Sum ∂f r over each block of a subset, (count, count), and return Σ(∂f)² of the subset."""
    count, width, squares = sums.shape[0], r.shape[0] // side, 0.0
    sums[:] = 0.0
    for j in range(side):
        for b in range(count):
            first, last = -(-b * side // count), -(-(b + 1) * side // count)
            line = slice(j * width + first, j * width + last)
            along, left = slope[line], r[line]
            product, square = np.float32(0), np.float32(0)
            for i in range(along.shape[0]):
                product += along[i] * left[i]
                square += along[i] * along[i]
            sums[j * count // side, b] += product
            squares += np.float64(square)
    return squares

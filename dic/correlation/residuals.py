"""What a subset leaves over, pixel by pixel: is it white noise, and is it one motion.

The variance of a displacement follows from that of Σ ∇f r, r being the noise. White noise sums up
as its variance says. Noise that is correlated, or stronger where the pattern is steep, as JPEG,
dirt on the sensor and interpolation leave it, sums up to more: sums over blocks of a subset, larger
than the speckles, say how much.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from dic.arrays import F32, F64, I64, AnyArray
from dic.compiled import njit
from dic.correlation.blocks import block_count
from dic.correlation.deformed_image import DeformedImage
from dic.correlation.newton import NOWHERE, Known, Points, bench_tools, normal_of
from dic.correlation.reference import Reference
from dic.correlation.subset import LOST, Tools, correlate_with, gather, lay_out, warp

Image: TypeAlias = tuple[AnyArray, bool]
"""Pixels of a frame, and whether they are coefficients."""

_SAMPLES, _FEW_SAMPLES = 144, 48  # subsets of a grid, and of scattered points
_FEWEST = 12  # subsets from which a mean is taken
_KNOWN = 0.3  # fraction of block sums that the fit must leave, or they say too little


def excess(ref: Reference, points: Points, frame: DeformedImage, valid: AnyArray) -> F64:
    """Variance of Σ ∂f/∂x r and of Σ ∂f/∂y r over that of the noise assumed, (2,), 1 or more.

    Parameters
    ----------
    valid : (N,) bool
        Points that were measured.
    """
    whole = np.flatnonzero(valid & (ref.light[:, 2] == ref.subset**2))
    expected = ref.block_gain
    if len(whole) < _FEWEST or expected.min() < _KNOWN:
        return np.ones(2)
    count = _SAMPLES if ref.grid is not None else _FEW_SAMPLES
    here = whole
    if len(whole) > count:
        here = whole[np.linspace(0, len(whole) - 1, count).astype(int)]
    ratios = np.full((len(here), 2), np.nan)
    _sum_blocks(
        textures_of(ref, here), (frame.pixels, frame.filtered), here, (ref.xy, points.motion),
        normal_of(ref), bench_tools(ref), block_count(ref.subset), ratios,
    )  # fmt: skip
    found = ratios[np.isfinite(ratios).all(axis=1)]
    if len(found) < _FEWEST:
        return np.ones(2)
    return np.maximum(found.mean(axis=0) / expected, 1.0)


def textures_of(ref: Reference, here: I64) -> tuple[F32, I64]:
    """Textures (·, 4, pixels), and which of them are those of the points `here`."""
    if ref.subsets is not None:
        return ref.subsets, here
    return gather(ref.texture, ref.xy[here], ref.half), np.arange(len(here))


@njit(cache=True, nogil=True, error_model="numpy")
def leave_over(
    pixels: F32,
    image: Image,
    place: F64,
    c: F64,
    known: Known,
    tools: Tools,
    towards: F64,
    r: F32,
) -> float:
    """Write what the fit of a subset leaves over (pixels,), and return its sum of squares.

    Less than nothing where the subset was lost.
    """
    inverse, light, half = known
    lay_out(pixels, place, tools)
    tools[9][:] = NOWHERE
    if warp(image[0], image[1], place, c, half, tools) == LOST:
        return -1.0
    squares = correlate_with(pixels, tools, towards)
    size = towards.shape[0]
    mean = towards[size - 1] / light[2]
    var_f = light[0] - light[1] ** 2 / light[2]
    gain = math.sqrt(max(squares - light[2] * mean**2, 1e-30) / max(var_f, 1e-30))
    g, f, weight, jacobian = tools[6][0], pixels[2], pixels[3], tools[2]
    for n in range(r.shape[0]):
        r[n] = g[n] * weight[n] / gain
    for k in range(size):
        step = 0.0
        for i in range(size):
            step -= inverse[k, i] * towards[i]
        step = np.float32(step / gain)
        if k < size - 2:
            row = jacobian[k]
            for n in range(r.shape[0]):
                r[n] += step * row[n]
        else:
            row = f if k == size - 2 else weight
            for n in range(r.shape[0]):
                r[n] -= step * row[n]
    total = 0.0
    for n in range(r.shape[0]):
        total += np.float64(r[n]) ** 2
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def _sum_blocks(
    textures: tuple[F32, I64],
    image: Image,
    here: I64,
    places: tuple[F64, F64],
    known: Known,
    tools: Tools,
    count: int,
    out: F64,
) -> None:
    """Write Σ(Σ ∇f r)² over blocks, over σ² Σ∇f², of each subset; NaN where it was lost."""
    (subsets, which), (xy, motion), (inverse, lights, half) = textures, places, known
    side, size = 2 * half + 1, inverse.shape[1]
    towards, r = np.empty(size), np.empty(subsets.shape[2], np.float32)
    sums = np.empty((2, count, count))
    for m in range(here.shape[0]):
        n, pixels = here[m], subsets[which[m]]
        total = leave_over(
            pixels, image, xy[n], motion[n], (inverse[n], lights[n], half), tools, towards, r
        )
        variance = total / max(lights[n, 2] - size, 1.0)
        if variance <= 0:
            continue
        for a in range(2):
            squares = _sum_by_block(pixels[a], r, side, sums[a])
            out[m, a] = np.sum(sums[a] ** 2) / (variance * squares) if squares > 0 else np.nan


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

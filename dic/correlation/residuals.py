"""What a subset leaves over, pixel by pixel: is it white noise, and is it one motion.

The variance of a displacement follows from that of Σ ∇f r, r being the noise. White noise sums up
as its variance says. Noise that is correlated, or stronger where the pattern is steep, as JPEG,
dirt on the sensor and interpolation leave it, sums up to more: sums over blocks of a subset, larger
than the speckles, say how much.
"""

from __future__ import annotations

import math

import numpy as np

from dic.arrays import F32, F64, I64, AnyArray
from dic.compiled import njit
from dic.correlation.blocks import block_count, sum_blocks
from dic.correlation.deformed_image import DeformedImage
from dic.correlation.newton import NOWHERE, Image, Known, Points, bench_tools, normal_of, sampled
from dic.correlation.reference import Reference
from dic.correlation.subset import LOST, Tools, correlate_with, gather, lay_out, subtract_fit, warp

SAMPLES = 144  # subsets that are warped anew
FEWEST = 12  # subsets from which a mean is taken
KNOWN = 0.3  # fraction of block sums that the fit must leave, or they say too little


def excess(ref: Reference, points: Points, frame: DeformedImage, valid: AnyArray) -> F64:
    """Variance of Σ ∂f/∂x r and of Σ ∂f/∂y r over that of the noise assumed, (2,), 1 or more.

    Parameters
    ----------
    valid : (N,) bool
        Points that were measured.
    """
    expected = ref.block_gain
    if expected.min() < KNOWN:
        return np.ones(2)
    found = _known(points.blocks[valid])
    if len(found) < FEWEST:  # of a grid none, and of scattered points where most are lost
        found = _known(_looked_at(ref, points, frame, valid))
    if len(found) < FEWEST:
        return np.ones(2)
    return np.maximum(found.mean(axis=0) / expected, 1.0)


def _known(ratios: F64) -> F64:
    return ratios[np.isfinite(ratios[:, 0])]


def _looked_at(ref: Reference, points: Points, frame: DeformedImage, valid: AnyArray) -> F64:
    """Sum over blocks of some subsets that are warped anew, (M, 2), as `Points.blocks`."""
    here = sampled(ref, valid, SAMPLES)
    ratios = np.full((len(here), 2), np.nan)
    _sum_blocks(
        textures_of(ref, here), (frame.pixels, frame.filtered), here, (ref.xy, points.motion),
        normal_of(ref), bench_tools(ref), block_count(ref.subset), ratios,
    )  # fmt: skip
    return ratios


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
    scratch: tuple[F64, F64],
    r: F32,
) -> float:
    """Write what the fit of a subset leaves over (pixels,), and return its sum of squares.

    Less than nothing where the subset was lost. `scratch` is two lines (K,) of unknowns.
    """
    (inverse, light, half), (towards, step) = known, scratch
    lay_out(pixels, place, tools)
    tools[9][:] = NOWHERE
    if warp(image[0], image[1], place, c, half, tools) == LOST:
        return -1.0
    squares = correlate_with(pixels, tools, towards)
    size = towards.shape[0]
    mean = towards[size - 1] / light[2]
    var_f = light[0] - light[1] ** 2 / light[2]
    gain = math.sqrt(max(squares - light[2] * mean**2, 1e-30) / max(var_f, 1e-30))
    for k in range(size):
        step[k] = 0.0
        for i in range(size):
            step[k] -= inverse[k, i] * towards[i] / gain
    return subtract_fit(pixels, step, gain, tools, r)


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
    scratch, r = (np.empty(size), np.empty(size)), np.empty(subsets.shape[2], np.float32)
    sums = np.empty((2, count, count))
    for m in range(here.shape[0]):
        n, pixels = here[m], subsets[which[m]]
        total = leave_over(
            pixels, image, xy[n], motion[n], (inverse[n], lights[n], half), tools, scratch, r
        )
        variance = total / max(lights[n, 2] - size, 1.0)
        sum_blocks(pixels, r, side, variance, sums, out[m])

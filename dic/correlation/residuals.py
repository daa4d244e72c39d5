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
_DIRECTIONS, _OFFSETS = 8, 5  # of lines along which a subset may break: at 0, ±0.3, ±0.6 of half
_NORMALS = tuple((math.cos(k * math.pi / 8), math.sin(k * math.pi / 8)) for k in range(8))
_SIDE = 0.1  # fraction of Σ∇f² that must lie on each side of a break


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
        _subsets(ref, here), (frame.pixels, frame.filtered), here, (ref.xy, points.motion),
        normal_of(ref), bench_tools(ref), block_count(ref.subset), ratios,
    )  # fmt: skip
    found = ratios[np.isfinite(ratios).all(axis=1)]
    if len(found) < _FEWEST:
        return np.ones(2)
    return np.maximum(found.mean(axis=0) / expected, 1.0)


def _subsets(ref: Reference, here: I64) -> tuple[F32, I64]:
    """Textures (·, 4, pixels), and which of them are those of the points `here`."""
    if ref.subsets is not None:
        return ref.subsets, here
    return gather(ref.texture, ref.xy[here], ref.half), np.arange(len(here))


@njit(cache=True, nogil=True, error_model="numpy")
def _leave(
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
        total = _leave(
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


def jumps(ref: Reference, points: Points, frame: DeformedImage, here: I64, smallest: float) -> F64:
    """Fit a jump along the best of forty lines to what subsets leave over.

    Parameters
    ----------
    here : (M,) int64
        The points whose subsets are looked at.
    smallest : float, px
        A smaller jump is compared with no curve.

    Returns
    -------
    (M, 7) float64
        χ² of the jump, and of a curve of one order more than the shape function in a light that
        varies; the jump (u, v), px; and the line: its normal (x, y), towards the side that has
        jumped, and its distance from the point along it, px. NaN where a subset was lost; χ² of
        the curve also where the jump is smaller than `smallest`.
    """
    out = np.full((len(here), 7), np.nan)
    _fit_jumps(
        _subsets(ref, here), (frame.pixels, frame.filtered), here, (ref.xy, points.motion),
        normal_of(ref), bench_tools(ref), (ref.order + 1, smallest), out,
    )  # fmt: skip
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _fit_jumps(
    textures: tuple[F32, I64],
    image: Image,
    here: I64,
    places: tuple[F64, F64],
    known: Known,
    tools: Tools,
    asked: tuple[int, float],
    out: F64,
) -> None:
    degree, smallest = asked
    (subsets, which), (xy, motion), (inverse, lights, half) = textures, places, known
    size = inverse.shape[1]
    towards, r = np.empty(size), np.empty(subsets.shape[2], np.float32)
    strips = np.empty((_OFFSETS + 1, 5 + 2 * size))
    for m in range(here.shape[0]):
        n, pixels = here[m], subsets[which[m]]
        total = _leave(
            pixels, image, xy[n], motion[n], (inverse[n], lights[n], half), tools, towards, r
        )
        if total <= 0:
            continue
        best = 0.0
        for direction in range(_DIRECTIONS):
            _sum_strips(pixels, r, direction, half, tools, strips)
            for line in range(_OFFSETS):
                chi, u, v = _jump(strips, line, inverse[n])
                if chi > best:
                    best = chi
                    out[m, 2], out[m, 3] = u, v
                    out[m, 4], out[m, 5] = _NORMALS[direction]
                    out[m, 6] = (0.3 * line - 0.6) * half
        left = max(total - best, 1e-6 * total) / max(lights[n, 2] - size - 2, 1.0)
        out[m, 0] = best / left
        if best > 0 and math.hypot(out[m, 2], out[m, 3]) > smallest:
            out[m, 1] = _curve(pixels, r, inverse[n], degree, tools) / left


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _sum_strips(pixels: F32, r: F32, direction: int, half: int, tools: Tools, strips: F64) -> None:
    """Sum ∇f r, ∇f∇fᵀ and ∇f Jᵀ over strips of a subset between the lines of a direction."""
    middle, jacobian, size = tools[1], tools[2], (strips.shape[1] - 5) // 2
    strips[:] = 0.0
    for n in range(r.shape[0]):
        if pixels[3, n] == 0:
            continue
        x, y = middle[0, n] / half, middle[1, n] / half
        along = _NORMALS[direction][0] * x + _NORMALS[direction][1] * y
        s = strips[int(min(max((along + 0.9) / 0.3, 0.0), 5.0))]
        fx, fy = pixels[0, n], pixels[1, n]
        s[0] += fx * r[n]
        s[1] += fy * r[n]
        s[2] += fx * fx
        s[3] += fx * fy
        s[4] += fy * fy
        for k in range(size - 2):
            s[5 + k] += fx * jacobian[k, n]
            s[5 + size + k] += fy * jacobian[k, n]
        s[3 + size] -= fx * pixels[2, n]
        s[4 + size] -= fx
        s[3 + 2 * size] -= fy * pixels[2, n]
        s[4 + 2 * size] -= fy


@njit(cache=True, nogil=True, error_model="numpy")
def _jump(strips: F64, line: int, inverse: F64) -> tuple[float, float, float]:
    """χ² (grey levels²) and size (u, v), px, of a jump of all strips beyond a line."""
    size = inverse.shape[0]
    s, all_of_it = np.zeros(strips.shape[1]), 0.0
    for k in range(strips.shape[0]):
        all_of_it += strips[k, 2] + strips[k, 4]
        if k > line:
            s += strips[k]
    if min(s[2] + s[4], all_of_it - s[2] - s[4]) < _SIDE * all_of_it:
        return 0.0, 0.0, 0.0
    bx, by = s[5 : 5 + size], s[5 + size :]
    cx, cy = inverse @ bx, inverse @ by
    xx, xy, yy = s[2] - bx @ cx, s[3] - bx @ cy, s[4] - by @ cy
    determinant = xx * yy - xy * xy
    if xx <= 0 or yy <= 0 or determinant <= 1e-3 * xx * yy:
        return 0.0, 0.0, 0.0
    u, v = (yy * s[0] - xy * s[1]) / determinant, (xx * s[1] - xy * s[0]) / determinant
    return u * s[0] + v * s[1], -u, -v  # g - f is -∇f · the motion


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _curve(pixels: F32, r: F32, inverse: F64, degree: int, tools: Tools) -> float:
    """χ² (grey levels²) of all terms of a degree in u and in v, and of light that varies."""
    middle, jacobian, size = tools[1], tools[2], inverse.shape[0]
    first = 2 * (degree + 1)
    count = first + 4
    more, own, across = np.zeros(count), np.zeros((count, count)), np.zeros((count, size))
    term = np.empty(count)
    half = np.float32(np.max(middle[0]))
    for n in range(r.shape[0]):
        if pixels[3, n] == 0:
            continue
        x, y = middle[0, n] / half, middle[1, n] / half
        for k in range(degree + 1):
            monomial = x**k * y ** (degree - k)
            term[2 * k], term[2 * k + 1] = monomial * pixels[0, n], monomial * pixels[1, n]
        term[first], term[first + 1] = x * pixels[2, n], y * pixels[2, n]
        term[first + 2], term[first + 3] = x, y
        for k in range(count):
            more[k] += term[k] * r[n]
            for i in range(count):
                own[k, i] += term[k] * term[i]
            for i in range(size - 2):
                across[k, i] += term[k] * jacobian[i, n]
            across[k, size - 2] -= term[k] * pixels[2, n]
            across[k, size - 1] -= term[k]
    normal = own - across @ inverse @ across.T
    for k in range(count):
        normal[k, k] += 1e-6 * own[k, k] + 1e-12
    return float(more @ np.linalg.solve(normal, more))

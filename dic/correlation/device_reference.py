"""What a device keeps of a reference from frame to frame, as tensors."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import solve_banded

from dic.arrays import F64, I64, AnyArray, Mask
from dic.correlation import breaks, jumps, point_status, residuals
from dic.correlation.blocks import block_count
from dic.correlation.dense_motion import catmull_rom
from dic.correlation.frame_moments import frame_plan
from dic.correlation.reference import Reference
from dic.fields import shape
from dic.fields.displacement import Status
from dic.fields.grid import Grid
from dic.images.prefilter import gaussian_taps
from dic.images.warp import PAD

if TYPE_CHECKING:
    from torch import Tensor


def check_device(device: str) -> None:
    """Raise ValueError unless torch is installed and can use the device in double precision."""
    try:
        import torch
    except ImportError:
        raise ValueError(
            f"device {device!r} needs torch, which is not installed; leave device out without it"
        ) from None
    try:
        torch.zeros(1, device=device, dtype=torch.float64).cpu()
    except (RuntimeError, AssertionError, NotImplementedError, TypeError):
        raise ValueError(
            f"device {device!r} cannot be used by torch here; use 'cpu' or leave device out"
        ) from None


@dataclass(frozen=True, eq=False)
class SubsetLine:
    """A line of subsets: what is summed along it, and what is interpolated between its points.

    Attributes
    ----------
    pixels : (n,) float32
        Those that the subsets cover, on the image.
    windows : (A, C, n) float32
        A power of the distance from each centre within its subset, 0 outside, for each sum that
        `frame_plan` takes along the line.
    between : (n, C') float32
        Weights of the points, continued beyond both ends, at each pixel.
    source : (C',) int64
        The point that each of them continues.
    beyond : (C',) float64, px
        How far from it.
    filtering : (E + 2 PAD, E) float32
        Coefficients of the spline of the E pixels of the image, after its prefilter.
    """

    pixels: Tensor
    windows: Tensor
    between: Tensor
    source: Tensor
    beyond: Tensor
    filtering: Tensor


@dataclass(frozen=True, eq=False)
class DeviceReference:
    """A reference on a grid as its device holds it; see `dic.correlation.reference.Reference`.

    Attributes
    ----------
    across, down : SubsetLine
    image : (H, W) float32
    texture : (4, H, W) float32
    part : (4, h, w) float32
        The texture where subsets lie.
    terms, sums : (V,), (S,) int64
        What is summed down the image, and which of those sums along x (`frame_plan`).
    xy : (N, 2) float64, px
    inverse : (N, K, K) float64
    light : (N, 3) float64
    contrast : (N,) float64
        Σ(f - mean f)².
    slope : (N,) float64
    noise_gain : (N, 2) float64
    variance : (N, 2, P) float64
        Diagonal of the inverse, infinite where nothing is known.
    freedom, floor, max_noise : (N,) float64
        By which the residual is corrected; what it is at least; and how much of Σ∇f∇fᵀ may be
        noise (`dic.correlation.point_status`).
    corners : (2, N, 2) float64, px
        Ends of each subset on the image, from its centre, along x and y.
    last : (2,) float64, px
        Place of the last pixel of the image.
    reach : (P,) float64
        What a coefficient of the shape function moves the edge of a subset by.
    status : (N,) int8
    usable : (N,) bool
        Where it is OK.
    sparse : (N,) bool
        Points at which a break is looked for.
    sampled : (N,) bool
        Points of which the residual may be looked at.
    scatter, block_gain : (2,) float64
        As of the reference.
    blocks : (B, S) float64
        Which pixels of a side S belong to which block of a subset.
    sides : (L, S²) float64
        Which pixels lie beyond which line across a subset.
    monomials : (P, S²) float64
        Of the shape function, at the pixels of a subset.
    """

    across: SubsetLine
    down: SubsetLine
    image: Tensor
    texture: Tensor
    part: Tensor
    terms: Tensor
    sums: Tensor
    xy: Tensor
    inverse: Tensor
    light: Tensor
    contrast: Tensor
    slope: Tensor
    noise_gain: Tensor
    variance: Tensor
    freedom: Tensor
    floor: Tensor
    max_noise: Tensor
    corners: Tensor
    last: Tensor
    reach: Tensor
    status: Tensor
    usable: Tensor
    sparse: Tensor
    sampled: Tensor
    scatter: Tensor
    block_gain: Tensor
    blocks: Tensor
    sides: Tensor
    monomials: Tensor


def put_reference(ref: Reference, grid: Grid, device: str) -> DeviceReference:
    """Put a reference on a device."""
    import torch

    def put(array: AnyArray, dtype: torch.dtype = torch.float64) -> Tensor:
        return torch.as_tensor(np.ascontiguousarray(array), dtype=dtype, device=device)

    plan = frame_plan(ref.order)
    height, width = ref.image.shape
    xs, ys = grid.pixels
    left, right = _covered(xs, ref.half, width)
    top, bottom = _covered(ys, ref.half, height)

    def axis(line: I64, first: int, last: int, end: int, powers: I64) -> SubsetLine:
        pixels = np.arange(first, last)
        source, beyond = _continued(grid, len(line))
        return SubsetLine(
            put(pixels, torch.float32),
            put(_windows(line, pixels, ref.half, powers), torch.float32),
            put(_between(grid, line, pixels), torch.float32),
            put(source, torch.int64),
            put(beyond),
            put(_filtering(end, ref.prefilter.sigma), torch.float32),
        )

    texture = put(ref.texture, torch.float32)
    pixels = np.maximum(ref.light[:, 2], 1)
    status = put(ref.status, torch.int8)
    return DeviceReference(
        across=axis(xs, left, right, width, plan.sums[:, 1]),
        down=axis(ys, top, bottom, height, plan.columns[:, 1]),
        image=put(ref.image, torch.float32),
        texture=texture,
        part=texture[:, top:bottom, left:right].contiguous(),
        terms=put(plan.columns[:, 0], torch.int64),
        sums=put(plan.sums[:, 0], torch.int64),
        xy=put(ref.xy),
        inverse=put(ref.inverse),
        light=put(ref.light),
        contrast=put(ref.light[:, 0] - ref.light[:, 1] ** 2 / pixels),
        slope=put(ref.slope),
        noise_gain=put(ref.noise_gain),
        variance=put(point_status.variance(ref)),
        freedom=put(point_status.freedom(ref)),
        floor=put(point_status.rounding(ref)),
        max_noise=put(point_status.max_noise(ref)),
        corners=put(_corners(ref)),
        last=put(np.array([width - 1, height - 1])),
        reach=put(float(ref.half) ** shape.monomials(shape.degree(ref.order)).sum(axis=1)),
        status=status,
        usable=status == int(Status.OK),
        sparse=put(breaks.sparse(ref, np.arange(len(ref.xy))), torch.bool),
        sampled=put(_sampled(ref), torch.bool),
        scatter=put(ref.scatter),
        block_gain=put(ref.block_gain),
        blocks=put(_blocks(ref.subset)),
        sides=put(_sides(ref.half)),
        monomials=put(_monomials(ref)),
    )


def _covered(line: I64, half: int, end: int) -> tuple[int, int]:
    """First pixel that a line of subsets covers, and the one behind its last."""
    return max(int(line[0]) - half, 0), min(int(line[-1]) + half + 1, end)


def _windows(line: I64, pixels: I64, half: int, powers: I64) -> F64:
    away = (pixels - line[:, None]).astype(np.float64)
    inside = np.abs(away) <= half
    return np.where(inside, away ** powers[:, None, None], 0.0)


def _continued(grid: Grid, count: int) -> tuple[I64, F64]:
    """Continue a line over its ends as `dense_motion.motion_grid`: which point, and how far."""
    margin = _margin(grid)
    place = np.arange(-margin, count + margin)
    source = np.clip(place, 0, count - 1)
    return source, grid.step * (place - source).astype(np.float64)


def _between(grid: Grid, line: I64, pixels: I64) -> F64:
    """Weigh the nodes of a continued line at pixels."""
    margin = _margin(grid)
    node, phase = np.divmod(pixels - (int(line[0]) - margin * grid.step), grid.step)
    matrix = np.zeros((len(pixels), len(line) + 2 * margin))
    for k, weight in enumerate(catmull_rom(grid.step)[phase].T):
        matrix[np.arange(len(pixels)), node - 1 + k] = weight
    return matrix


def _margin(grid: Grid) -> int:
    return grid.subset // 2 // grid.step + 2


def _filtering(count: int, sigma: float) -> F64:
    """Gaussian and inverse of the spline along a line, with the borders of `dic.images.spline`."""
    smooth = _convolved(count, gaussian_taps(sigma).astype(np.float64))
    knots = _convolved(count, np.array([1, 26, 66, 26, 1]) / 120)
    bands = np.zeros((5, count))
    for offset in range(-2, 3):
        diagonal = np.diagonal(knots, offset)
        bands[2 - offset, max(offset, 0) : count + min(offset, 0)] = diagonal
    return _extended(count, PAD) @ np.asarray(solve_banded((2, 2), bands, smooth))


def _convolved(count: int, taps: F64) -> F64:
    """Weigh each value of a line, continued beyond its ends, with its neighbours, (n, n)."""
    every, total = _extended(count, len(taps) // 2), np.zeros((count, count))
    for k, weight in enumerate(taps):
        total += weight * every[k : k + count]
    return total


def _extended(count: int, reach: int) -> F64:
    """Continue a line of values by its mirror turned about its ends, (count + 2 reach, count)."""
    inner = np.eye(count)
    low = 2 * inner[0] - inner[reach:0:-1]
    high = 2 * inner[-1] - inner[-2 : -2 - reach : -1]
    return np.concatenate([low, inner, high])


def _corners(ref: Reference) -> F64:
    height, width = ref.image.shape
    centre = np.rint(ref.xy)
    low = np.maximum(-ref.half, -centre)
    high = np.minimum(ref.half, np.array([width, height]) - 1 - centre)
    return np.stack([low, high])


def _sampled(ref: Reference) -> Mask:
    whole = ref.light[:, 2] == ref.subset**2
    return whole & bool(ref.block_gain.min() >= residuals.KNOWN)


def _blocks(side: int) -> F64:
    count = block_count(side)
    return (np.arange(side) * count // side == np.arange(count)[:, None]).astype(np.float64)


def _sides(half: int) -> F64:
    ranges, column = jumps.sides(half), np.arange(2 * half + 1)
    inside = (column >= ranges[..., :1]) & (column < ranges[..., 1:])
    return inside.reshape(-1, (2 * half + 1) ** 2).astype(np.float64)


def _monomials(ref: Reference) -> F64:
    eta, xi = np.mgrid[-ref.half : ref.half + 1, -ref.half : ref.half + 1].reshape(2, -1)
    powers = shape.monomials(shape.degree(ref.order))
    return np.stack([np.asarray(xi**a * eta**b, dtype=np.float64) for a, b in powers])

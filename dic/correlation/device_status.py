"""The status of each point and the uncertainty of a field on a device: `point_status` in torch."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dic.arrays import F64
from dic.correlation import breaks, device_subsets, point_status
from dic.correlation.device_points import DevicePoints, leaves_image
from dic.correlation.device_reference import DeviceReference
from dic.correlation.reference import Reference
from dic.fields import roughness
from dic.fields.displacement import DisplacementField, Status
from dic.fields.grid import Grid
from dic.images.spline import noise_power, noise_slope

if TYPE_CHECKING:
    from torch import Tensor


class DeviceImage(NamedTuple):
    """An image of a frame on the device.

    Attributes
    ----------
    grey : (H, W) float32
    spline : (H + 2 PAD, W + 2 PAD) float32
        Its coefficients, after the prefilter.
    levels : (2,) float32
        Black and white; NaN where they are not known.
    """

    grey: Tensor
    spline: Tensor
    levels: Tensor


def measure(
    ref: Reference, grid: Grid, known: DeviceReference, points: DevicePoints, frame: DeviceImage
) -> Tensor:
    """Turn the last state of the points into numbers (15 N + 1,), for `unpacked`.

    The last says whether a break may be in them.
    """
    import torch

    motion = points.motion
    noise = _noise(ref, known, points)
    clipped = _clipped(ref, known, points, frame)
    status = _status(ref, known, points, noise, clipped)
    broken = _may_be_broken(grid, known, points, frame.spline, noise, status)
    lost = status != int(Status.OK)
    correlated = device_subsets.noise_excess(known, motion, frame.spline, ~lost)
    fraction = _noise_fraction(ref, known, noise)
    scale = noise / (1 - fraction).sqrt() * _widening(known, fraction)
    scale = scale * (1 + clipped / point_status.ONE_SIDED).prod(0)
    gain = known.noise_gain * correlated * point_status.images(ref)
    spread = scale[:, None, None] * (known.variance * gain[:, :, None]).sqrt()
    spread = spread * known.scatter[:, None]
    bias = math.sqrt(2) * ref.prefilter.bias * (2 * math.pi * motion[:, :, 0]).sin()
    spread[:, :, 0] = spread[:, :, 0].hypot(bias)
    motion = motion.masked_fill(lost[:, None, None], math.nan)
    spread = spread.masked_fill(lost[:, None, None], math.nan)
    u = motion[:, :, 0].T.reshape(2, *grid.shape)
    spread = spread * _roughness(u, spread[:, :, 0].T.reshape(u.shape), grid, ref.order)
    bend = _flattening(u, grid, ref.order).reshape(2, -1).T
    spread[:, :, 0] = spread[:, :, 0].hypot(bend)
    zncc = points.zncc.masked_fill(~known.usable, math.nan)
    iterations = points.iterations.masked_fill(~known.usable, 0)
    parts = (*motion[:, :, 0].T, *spread[:, :, 0].T, zncc, iterations.double(), status.double())
    slopes = (motion[:, :, 1:3].reshape(-1), spread[:, :, 1:3].reshape(-1))
    return torch.cat([*parts, *slopes, broken.double()[None]])


def unpacked(ref: Reference, numbers: F64) -> DisplacementField:
    """Arrange the numbers of `measure`, brought to the host, as a field."""
    count = len(ref.xy)
    u, v, sigma_u, sigma_v, zncc, iterations, status = numbers[: 7 * count].reshape(7, count)
    gradient, sigma_gradient = numbers[7 * count : 15 * count].reshape(2, count, 2, 2)
    return DisplacementField(
        xy=ref.xy,
        u=u,
        v=v,
        sigma_u=sigma_u,
        sigma_v=sigma_v,
        gradient=gradient,
        sigma_gradient=sigma_gradient,
        zncc=zncc,
        iterations=iterations.astype(np.int16),
        valid_fraction=ref.light[:, 2] / ref.subset**2,
        status=status.astype(np.int8),
        subset=ref.subset,
        order=ref.order,
        grid=ref.grid,
        prefilter=ref.prefilter.sigma,
    )


def _noise(ref: Reference, known: DeviceReference, points: DevicePoints) -> Tensor:
    residual = (points.residual * known.freedom).maximum(known.floor)
    return (residual / _noise_gain(ref, points.motion)).sqrt()


def _noise_gain(ref: Reference, motion: Tensor) -> Tensor:
    mean, harmonic = noise_power(ref.prefilter.sigma)
    swept = (2 * ref.half * motion[:, :, 1:3]).sinc().prod(2)
    kept = (mean + harmonic * (2 * math.pi * motion[:, :, 0]).cos() * swept).prod(1)
    return 1 + kept / ref.stills


def _noise_fraction(ref: Reference, known: DeviceReference, noise: Tensor) -> Tensor:
    power = noise_slope(ref.prefilter.sigma) * noise.square() / ref.stills
    return (power / known.slope.square().clamp(min=1e-30)).minimum(known.max_noise)


def _widening(known: DeviceReference, fraction: Tensor) -> Tensor:
    fewer = 4 * fraction / (1 - fraction) / known.light[:, 2].clamp(min=1.0)
    return 1 + (point_status.FAR**2 + 1) / 4 * fewer


def _status(
    ref: Reference, known: DeviceReference, points: DevicePoints, noise: Tensor, clipped: Tensor
) -> Tensor:
    """Name what became of each point; what is named first stands."""
    found = points.zncc >= point_status.FOUND
    level = _level(noise, known.usable & found)
    disturbed = (noise > point_status.DISTURBED * level) & (points.zncc < point_status.WHOLE)
    status = known.status
    for condition, name in (
        (_is_flat(ref, known, level), Status.FLAT),
        (leaves_image(known, points.motion), Status.OUTSIDE),
        (~found, Status.LOW_CORRELATION),
        (~(points.still | (points.change <= point_status.STOPPED)), Status.NOT_CONVERGED),
        (clipped[0] > point_status.CLIPPED, Status.DARK),
        (clipped[1] > point_status.CLIPPED, Status.SATURATED),
        (disturbed, Status.DISTURBED),
    ):
        status = status.masked_fill((status == int(Status.OK)) & condition, int(name))
    return status


def is_flat(ref: Reference, known: DeviceReference, points: DevicePoints) -> Tensor:
    """Find where too much of the slope is noise, as far as is known yet, (N,) bool."""
    noise = (points.residual.clamp(min=0) / _noise_gain(ref, points.motion)).sqrt()
    found = known.usable & (points.zncc >= point_status.FOUND)
    return _is_flat(ref, known, _level(noise, found))


def _is_flat(ref: Reference, known: DeviceReference, level: Tensor) -> Tensor:
    lowest = (noise_slope(ref.prefilter.sigma) / known.max_noise).sqrt()
    return known.slope < lowest * level / math.sqrt(ref.stills)


def _level(noise: Tensor, among: Tensor) -> Tensor:
    """Median noise; 0 where there is none."""
    return noise.masked_fill(~among, math.nan).nanmedian().nan_to_num(0.0)


def _may_be_broken(
    grid: Grid,
    known: DeviceReference,
    points: DevicePoints,
    spline: Tensor,
    noise: Tensor,
    status: Tensor,
) -> Tensor:
    """Whether some subset shows a break, by what `breaks.lines` looks at, () bool."""
    valid = status == int(Status.OK)
    level = noise / _level(noise, valid)
    limit = 1 + breaks.SUSPECT / (2 * known.light[:, 2].clamp(min=1.0)).sqrt()
    torn = _torn(grid, points.motion[:, :, 0].masked_fill(~valid[:, None], math.nan))
    loud = (valid | (status == int(Status.DISTURBED))) & ((level > limit) | torn)
    louder = level.masked_fill(~(loud & known.sparse), 0.0)
    return device_subsets.may_be_broken(known, points.motion, spline, louder)


def _torn(grid: Grid, moved: Tensor) -> Tensor:
    """Points on both sides of which motions (N, 2) differ, as in `breaks`, (N,) bool."""
    import torch

    u, reach = moved.T.reshape(2, *grid.shape), breaks.across_subset(grid)
    apart = torch.zeros_like(u[0])
    for axis in (0, 1):
        count = u.shape[axis + 1] - 2 * reach
        if count > 0:
            low, high = (u.narrow(axis + 1, first, count) for first in (0, 2 * reach))
            middle = apart.narrow(axis, reach, count)
            moved = (high - low).square().sum(0).sqrt()
            middle.copy_(middle.maximum(moved.nan_to_num(0.0)))
    limit = (breaks.USUAL * apart.median()).clamp(min=breaks.JUMP)
    return (apart > limit).reshape(-1)


def _clipped(
    ref: Reference, known: DeviceReference, points: DevicePoints, frame: DeviceImage
) -> Tensor:
    """Fraction of each subset that clips in the frame and did not before, (2, N)."""
    looked_at = known.usable & (points.zncc >= point_status.FOUND)
    looked_at &= points.zncc < point_status.CLEAR
    moved = known.xy + points.motion[:, :, 0]
    levels = frame.levels[:, None, None]
    more = _count(frame.grey == levels, moved, ref.subset)
    more = more - _count(known.image == levels, known.xy, ref.subset)
    return (more.clamp(min=0) / ref.subset**2).masked_fill(~looked_at, 0.0)


def _count(there: Tensor, xy: Tensor, subset: int) -> Tensor:
    """Count the pixels (2, H, W) of each subset on the image that are there, (2, N) float64."""
    from torch.nn.functional import avg_pool2d

    half, (rows, columns) = subset // 2, there.shape[1:]
    along = avg_pool2d(there.float(), (1, subset), 1, (0, half))
    means = avg_pool2d(along, (subset, 1), 1, (half, 0))
    x, y = xy.nan_to_num(0.0).round().long().unbind(1)
    return (means[:, y.clamp(0, rows - 1), x.clamp(0, columns - 1)] * subset**2).round().double()


def _roughness(u: Tensor, sigma: Tensor, grid: Grid, order: int) -> Tensor:
    """Compare fourth differences of a field (2, R, C) with its σ, as `roughness.excess`."""
    import torch

    place, weights, expected = roughness.differences(order, grid.subset, grid.step)
    variance, reach = sigma.square().clamp(min=roughness.EXACT**2), place[-1]
    ratios: list[Tensor] = []
    for axis in (1, 2):
        count = u.shape[axis] - reach
        if count < 1:
            continue
        middle = variance.narrow(axis, reach // 2, count)
        rough = torch.zeros_like(middle)
        for weight, first in zip(weights, place, strict=True):
            rough += weight * u.narrow(axis, first, count)
        ratios.append((rough.square() / (expected * middle)).reshape(-1))
    if not ratios:
        return torch.ones((), device=u.device, dtype=u.dtype)
    every = torch.cat(ratios)
    every = every.masked_fill(~every.isfinite(), math.nan)
    enough = every.isfinite().sum() >= roughness.FEWEST
    rougher = (every.nanmedian() / roughness.MEDIAN).sqrt() / roughness.USUAL
    return rougher.clamp(min=1.0).where(enough, 1.0)


def _flattening(u: Tensor, grid: Grid, order: int) -> Tensor:
    """Estimate by how much subsets flatten a field (2, R, C), as `roughness.flattening`."""
    import torch

    bend = torch.zeros_like(u)
    if order > 1:
        return bend
    reach, scale = roughness.bending(grid)
    for axis in (1, 2):
        count = u.shape[axis]
        if count <= 2 * reach:
            continue
        at = torch.arange(count, device=u.device).clamp(reach, count - 1 - reach)
        low, middle, high = (u.index_select(axis, at + d) for d in (-reach, 0, reach))
        bend += (low - 2 * middle + high).nan_to_num(0.0)
    return scale * bend

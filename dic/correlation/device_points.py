"""The points of a reference while they are iterated on a device: `newton` and `dense_motion`."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dic.correlation.device_reference import DeviceReference
from dic.correlation.newton import STILL, STRIDE, Points
from dic.correlation.point_status import BEYOND
from dic.correlation.start import Start
from dic.fields.displacement import DisplacementField

if TYPE_CHECKING:
    from torch import Tensor

_TOGETHER = 20_000_000  # distances between points at a time


class DevicePoints(NamedTuple):
    """State of the N points, as `dic.correlation.newton.Points`."""

    motion: Tensor
    change: Tensor
    zncc: Tensor
    residual: Tensor
    iterations: Tensor
    still: Tensor

    def on_host(self) -> Points:
        """Bring the points back."""
        points = Points(self.motion.cpu().numpy())
        points.change, points.zncc = self.change.cpu().numpy(), self.zncc.cpu().numpy()
        points.residual, points.still = self.residual.cpu().numpy(), self.still.cpu().numpy()
        points.iterations = self.iterations.cpu().numpy().astype(np.int16)
        return points


def put_start(known: DeviceReference, begun: Start) -> DevicePoints:
    """Put the motion to start from on the device, continued to where it is not known."""
    import torch

    device = known.xy.device
    motion = _motion(known, torch.as_tensor(begun.shift, device=device))
    if begun.gradient is not None:
        motion[:, :, 1:3] = torch.as_tensor(begun.gradient, device=device)
    if not begun.known.all():
        motion = fill(known, motion, torch.as_tensor(begun.known, device=device))
    return _first(motion)


def put_field(known: DeviceReference, guess: DisplacementField, order: int) -> DevicePoints | None:
    """Start from a field of the same points; None where it says nothing, or too much."""
    import torch

    device, largest = known.xy.device, max(known.image.shape)
    lines = (guess.u, guess.v)
    there = np.isfinite(guess.u) & np.isfinite(guess.v)
    if not there.any() or any((np.abs(line) > largest).any() for line in lines):
        return None
    motion = _motion(
        known, torch.stack([torch.as_tensor(line, device=device) for line in lines], 1)
    )
    if order:
        motion[:, :, 1:3] = torch.as_tensor(guess.gradient, device=device)
    if not there.all():
        motion = fill(known, motion, torch.as_tensor(there, device=device))
    return _first(motion)


def _motion(known: DeviceReference, shift: Tensor) -> Tensor:
    """Coefficients (N, 2, P) of a shift (N, 2)."""
    import torch

    motion = torch.zeros(len(shift), 2, len(known.reach), device=shift.device, dtype=shift.dtype)
    motion[:, :, 0] = shift
    return motion


def _first(motion: Tensor) -> DevicePoints:
    """State of points before their first step."""
    import torch

    count = len(motion)
    never = torch.full((count,), math.nan, device=motion.device, dtype=motion.dtype)
    nothing = torch.zeros(count, device=motion.device, dtype=torch.int16)
    return DevicePoints(motion, never, never, never, nothing, nothing.bool())


def put_points(known: DeviceReference, points: Points) -> DevicePoints:
    """Put points that were iterated on the host back on the device."""
    import torch

    state = (points.motion, points.change, points.zncc, points.residual)
    every = (*state, points.iterations, points.still)
    return DevicePoints(*(torch.as_tensor(array, device=known.xy.device) for array in every))


def step(known: DeviceReference, points: DevicePoints, sums: Tensor, base: Tensor) -> DevicePoints:
    """Take one Gauss-Newton step of all points, from sums of motion less `base`."""
    import torch

    count, size = points.motion.shape[2], known.inverse.shape[1]
    pixels = known.light[:, 2].clamp(min=1.0)
    fg, g, fq, q, gg, gq, qq = sums[:, 4 * count :].T
    var_g = gg - g * g / pixels
    dark = (known.contrast <= 0) | (var_g <= 1e-9 * gg)
    zncc = (fg - known.light[:, 1] * g / pixels) / (known.contrast * var_g).sqrt()
    gain = (var_g / known.contrast).sqrt()
    slopes, dense = sums[:, : 2 * count], sums[:, 2 * count : 4 * count]
    light = torch.stack([fq - fg / gain, q - g / gain], 1), torch.stack([fq, q], 1)
    towards = torch.cat([slopes / gain[:, None] - dense, light[0]], 1)
    right = torch.stack([towards, torch.cat([-dense, light[1]], 1)], 2)
    total, aside = (-known.inverse @ right).unbind(2)
    squares = gg / gain**2 - 2 * gq / gain + qq + (towards * total).sum(1)
    aside = aside[:, :-2].reshape(-1, 2, count)
    total = total[:, :-2].reshape(-1, 2, count) - aside
    aside = aside - points.motion
    aside[:, :, 0] += base
    change = _change(points.motion, total, aside)
    moved = (change.abs() * known.reach).amax(dim=(1, 2))
    still = (moved < STILL) | (moved * moved < STILL * points.change) | dark
    residual = squares / (known.light[:, 2] - size).clamp(min=1.0)
    return DevicePoints(
        torch.where(dark[:, None, None], points.motion, points.motion + change),
        moved.masked_fill(dark, 0.0),
        zncc.masked_fill(dark, 0.0),
        residual.masked_fill(dark, 0.0),
        points.iterations + ~points.still,
        still,
    )


def _change(c: Tensor, step: Tensor, aside: Tensor) -> Tensor:
    """Turn the step of the inverse composition into the change of the coefficients (N, 2, P)."""
    reach = (step + aside)[:, :, 0].norm(dim=1)
    brake = (STRIDE / reach).clamp(max=1.0)
    u, v = step.unbind(1)
    slopes = c[:, :, 1:3].unsqueeze(3)
    moved = aside + step + slopes[:, :, 0] * u[:, None] + slopes[:, :, 1] * v[:, None]
    return brake[:, None, None] * moved


def leaves_image(known: DeviceReference, motion: Tensor) -> Tensor:
    """Find where a corner of the moved subset lies beyond the last pixels, (N,) bool."""
    import torch

    slope = motion[:, :, 1:3] + torch.eye(2, device=motion.device, dtype=motion.dtype)
    ends = slope * known.corners[:, :, None]
    place = known.xy.round() + motion[:, :, 0]
    first = place + ends.amin(0).sum(2)
    last = place + ends.amax(0).sum(2)
    return ((first < -BEYOND) | (last > known.last + BEYOND)).any(1)


def fill(known: DeviceReference, motion: Tensor, good: Tensor) -> Tensor:
    """Give each point that is not good the motion of its nearest good neighbour, by its gradient.

    See `dic.correlation.dense_motion.fill`.
    """
    target, source = (~good).nonzero()[:, 0], good.nonzero()[:, 0]
    if not len(target) or not len(source):
        return motion
    filled = motion.clone()
    x, y = known.xy.float().unbind(1)
    for here in target.split(max(_TOGETHER // len(source), 1)):
        across, down = x[here, None] - x[source], y[here, None] - y[source]
        near = source[(across * across + down * down).argmin(1)]
        apart = (known.xy[here] - known.xy[near])[:, None]
        filled[here] = motion[near]
        filled[here, :, 0] += (motion[near, :, 1:3] * apart).sum(2)
    return filled

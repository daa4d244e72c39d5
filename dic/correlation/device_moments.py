"""The sums of `dic.correlation.frame_moments` by torch, on whatever device it knows.

Everything but the look-up in the spline is a product of matrices: the motion between the points is
interpolated along each axis, and windows are summed along each axis. The matrices are mostly zeros,
which a GPU does not mind.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dic.arrays import F32, F64, I64, AnyArray
from dic.correlation.dense_motion import MotionGrid
from dic.correlation.frame_moments import frame_plan
from dic.fields.grid import Grid
from dic.images.warp import PAD, TAPS, knot_weights

if TYPE_CHECKING:
    from torch import Tensor


def check_device(device: str) -> None:
    """Raise ValueError unless torch is installed and can use the device."""
    try:
        import torch
    except ImportError:
        raise ValueError(
            f"device {device!r} needs torch, which is not installed; leave device out without it"
        ) from None
    try:
        torch.zeros(1, device=device).cpu()
    except (RuntimeError, AssertionError, NotImplementedError):
        raise ValueError(
            f"device {device!r} cannot be used by torch here; use 'cpu' or leave device out"
        ) from None


def summing(
    texture: F32, spline: F32, grid: Grid, order: int, device: str
) -> Callable[[MotionGrid], F64]:
    """Prepare the sums of a frame: a function of the dense motion that gives (N, S) float64.

    Parameters
    ----------
    texture : (4, H, W) float32
    spline : (H + 2 PAD, W + 2 PAD) float32
        Coefficients of the frame.
    grid : Grid
    order : int
    device : str
        As `torch.device` takes it.

    Notes
    -----
    Pixels, motion and sums are single precision: a displacement differs by less than 1e-4 px from
    that of `dic.correlation.frame_moments`, the σ of images without noise by more.
    """
    import torch

    half, size = grid.subset // 2, texture.shape[:0:-1]
    axes = [_Axis(line, half, end) for line, end in zip((grid.xs, grid.ys), size, strict=True)]
    across, down = (axis.pixels for axis in axes)
    part = _put(texture[:, down[0] : down[-1] + 1, across[0] : across[-1] + 1], device)
    coefficients = _put(spline, device)
    columns, sums = frame_plan(order)
    over_x, over_y = (_put(axis.windows(sums[:, 1].max()), device) for axis in axes)

    def take(net: MotionGrid) -> F64:
        between = [
            _put(_interpolation(net, axis.pixels - origin, count), device)
            for axis, origin, count in zip(axes, net.origin, net.motion.shape[:0:-1], strict=True)
        ]
        motion = between[1] @ _put(net.motion, device) @ between[0].T
        g = _warp(coefficients, [axis.pixels for axis in axes], net.base, motion)
        terms = _terms(part, g, motion)
        standing: list[Tensor] = [over_y[power] @ terms[term] for term, power in columns]
        found: list[Tensor] = [standing[column] @ over_x[power].T for column, power in sums]
        return torch.stack(found, dim=-1).reshape(-1, len(found)).cpu().numpy().astype(np.float64)

    return take


class _Axis:
    """The pixels of a line of subsets, and how they are summed."""

    def __init__(self, centres: AnyArray, half: int, end: int):
        first, last = int(centres[0]) - half, int(centres[-1]) + half
        self.pixels: I64 = np.arange(max(first, 0), min(last + 1, end))
        self._away: I64 = self.pixels - centres[:, None]
        self._half = half

    def windows(self, highest: int) -> NDArray[np.floating]:
        """Powers of the distance from each centre within its subset, (A, C, pixels)."""
        powers = np.arange(highest + 1)[:, None, None]
        away = self._away.astype(np.float64)
        return np.where(np.abs(away) <= self._half, away**powers, 0.0)


def _put(array: AnyArray, device: str) -> Tensor:
    import torch

    return torch.as_tensor(np.ascontiguousarray(array, dtype=np.float32), device=device)


def _interpolation(net: MotionGrid, places: I64, count: int) -> F64:
    """Weights (P, count) of the nodes at places, px from the first node."""
    node, phase = np.divmod(places, net.step)
    matrix = np.zeros((len(places), count))
    for k, weight in enumerate(net.weights()[phase].T):
        matrix[np.arange(len(places)), node - 1 + k] = weight
    return matrix


@cache
def _spline_powers() -> NDArray[np.floating]:
    """Weigh the knots -2 … 3 as polynomials of the fraction t: (TAPS, TAPS), powers rising."""
    t = np.linspace(0, 1, TAPS)
    values = np.array([knot_weights(one) for one in t], dtype=np.float64)
    return np.linalg.solve(t[:, None] ** np.arange(TAPS), values).T


def _warp(spline: Tensor, pixels: list[AnyArray], base: tuple[int, int], motion: Tensor) -> Tensor:
    """Frame at the moved pixels, (H, W), kept on the image as `dic.images.warp` does."""
    import torch

    cells: list[Tensor] = []
    taps: list[Tensor] = []
    for axis, shape in ((0, (1, -1)), (1, (-1, 1))):
        place = _put(pixels[axis] + base[axis], str(motion.device)).reshape(shape)
        end = spline.shape[1 - axis] - 2 * PAD
        shift = torch.minimum(torch.maximum(motion[axis], -0.5 - place), end - 0.5 - place)
        whole = torch.floor(shift)
        cells.append((place + whole).long() + PAD - 2)
        taps.append(_put(_spline_powers(), str(motion.device)) @ _powers(shift - whole))
    first = cells[1] * spline.shape[1] + cells[0]
    across, down = (tap.reshape(TAPS, *first.shape) for tap in taps)
    flat, g = spline.reshape(-1), torch.zeros_like(motion[0])
    for k in range(TAPS):
        line = first + k * spline.shape[1]
        g += down[k] * sum(across[i] * flat[line + i] for i in range(TAPS))
    return g


def _powers(t: Tensor) -> Tensor:
    import torch

    return torch.stack([t**p for p in range(TAPS)]).reshape(TAPS, -1)


def _terms(texture: Tensor, g: Tensor, motion: Tensor) -> tuple[Tensor, ...]:
    """Pair the texture with g and with q = ∇f·U, in the order of `frame_plan`."""
    fx, fy, f, weight = texture
    g, q = weight * g, fx * motion[0] + fy * motion[1]
    return fx * g, fy * g, fx * q, fy * q, f * g, g, f * q, q, g * g, g * q, q * q

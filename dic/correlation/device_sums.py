"""The sums of `dic.correlation.frame_moments` on a device.

Everything but the look-up in the spline is a product of matrices: the motion between the points is
interpolated along each axis, and windows are summed along each axis. The matrices are mostly zeros,
which a GPU does not mind.

Pixels, motion and sums are single precision: a displacement differs by less than 1e-4 px from that
of `frame_moments`, the σ of images without noise by more.
"""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from dic.correlation.device_reference import DeviceReference
from dic.images.warp import PAD, TAPS, knot_weights

if TYPE_CHECKING:
    from torch import Tensor, device

_ENOUGH = 1000  # points of which the median motion is taken


def sums_on_device(known: DeviceReference, spline: Tensor, motion: Tensor) -> tuple[Tensor, Tensor]:
    """Sum under each subset, the frame warped by the dense motion between the points.

    Parameters
    ----------
    known : DeviceReference
    spline : (H + 2 PAD, W + 2 PAD) float32
        Coefficients of the frame.
    motion : (N, 2, P) float64, px
        Coefficients of the shape function of each point.

    Returns
    -------
    sums : (N, S) float64
        In the order of `frame_plan`.
    base : (2,) float64, px
        Whole part of the motion, of which the sums hold the rest.
    """
    across, down = known.across, known.down
    some = motion[:: max(len(motion) // _ENOUGH, 1), :, 0]
    base = some.median(dim=0).values.round()
    dense = _dense(known, motion, base)
    place = (across.pixels + base[0]).float()[None], (down.pixels + base[1]).float()[:, None]
    g = sample(spline, place, (dense[0], dense[1]))
    terms = _terms(known.part, g, dense)
    standing = down.windows @ terms[known.terms]
    found = standing[known.sums] @ across.windows.mT
    return found.reshape(len(found), -1).T.double(), base


def _dense(known: DeviceReference, motion: Tensor, base: Tensor) -> Tensor:
    """Interpolate the motion less its base at every pixel, (2, h, w) float32."""
    rows, columns = known.down.source, known.across.source
    nodes = motion[:, :, :3].reshape(known.down.windows.shape[1], -1, 2, 3)[rows][:, columns]
    u = nodes[..., 0] - base
    u = u + nodes[..., 1] * known.across.beyond[:, None]
    u = u + nodes[..., 2] * known.down.beyond[:, None, None]
    return known.down.between @ u.float().permute(2, 0, 1) @ known.across.between.T


def sample(spline: Tensor, place: tuple[Tensor, Tensor], motion: tuple[Tensor, Tensor]) -> Tensor:
    """Value of the spline at whole places (x, y) px that have moved, kept on the image.

    Places and motion are those of `dic.images.warp`, and may be of any shapes that go together.
    """
    import torch

    cells: list[Tensor] = []
    taps: list[Tensor] = []
    for axis in range(2):
        end = spline.shape[1 - axis] - 2 * PAD
        shift = torch.minimum(
            torch.maximum(motion[axis], -0.5 - place[axis]), end - 0.5 - place[axis]
        )
        whole = shift.floor()
        cells.append((place[axis] + whole).long() + (PAD - 2))
        taps.append(_knots(shift - whole))
    first, flat = cells[1] * spline.shape[1] + cells[0], spline.reshape(-1)
    along = torch.arange(TAPS, device=spline.device).reshape(-1, *(1,) * first.ndim)
    g = torch.zeros_like(taps[0][0])
    for k in range(TAPS):
        g += taps[1][k] * (taps[0] * flat[first + k * spline.shape[1] + along]).sum(0)
    return g


def _knots(t: Tensor) -> Tensor:
    """Weigh the knots -2 … 3 at the fractions t, (TAPS, ...)."""
    import torch

    powers = torch.stack([t**p for p in range(TAPS)])
    return torch.tensordot(_spline_powers(t.device), powers, 1)


@cache
def _spline_powers(device: device) -> Tensor:
    """Weigh the knots -2 … 3 as polynomials of the fraction t: (TAPS, TAPS), powers rising."""
    import torch

    t = np.linspace(0, 1, TAPS)
    values = np.array([knot_weights(one) for one in t], dtype=np.float64)
    powers = np.linalg.solve(t[:, None] ** np.arange(TAPS), values).T
    return torch.as_tensor(powers.astype(np.float32), device=device)


def _terms(texture: Tensor, g: Tensor, motion: Tensor) -> Tensor:
    """Pair the texture with g and with q = ∇f·U, (11, h, w), in the order of `frame_plan`."""
    import torch

    fx, fy, f, weight = texture
    g, q = weight * g, fx * motion[0] + fy * motion[1]
    return torch.stack([fx * g, fy * g, fx * q, fy * q, f * g, g, f * q, q, g * g, g * q, q * q])

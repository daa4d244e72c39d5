"""A small U-Net on cells: convolutions at four scales, whose ways up are added."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from models.arrays import F32
from models.image_net.features import INPUTS, PARTS

if TYPE_CHECKING:
    from torch import Tensor

Weights = dict[str, F32]

WIDTHS = (24, 40, 64, 64)
EACH = PARTS + 2  # weights of the windows, a free part, and ln σ, of u and of v
OUTPUTS = 2 * EACH
LOGARITHM = 4.0  # largest change of ln σ


def shapes() -> dict[str, tuple[int, ...]]:
    """Shape of every weight by its name: each convolution (out, in, k, k) and its biases."""
    a, b, c, d = WIDTHS
    convolutions = {
        "down0a": (a, INPUTS, 3), "down0b": (a, a, 3), "down1a": (b, a, 3), "down1b": (b, b, 3),
        "down2a": (c, b, 3), "down2b": (c, c, 3), "down3a": (d, c, 3), "down3b": (d, d, 3),
        "down3c": (d, d, 3), "link2": (c, d, 1), "up2": (c, c, 3), "link1": (b, c, 1),
        "up1": (b, b, 3), "link0": (a, b, 1), "up0": (a, a, 3), "out": (OUTPUTS, a, 1),
    }  # fmt: skip
    found: dict[str, tuple[int, ...]] = {}
    for name, (out, into, side) in convolutions.items():
        found |= {f"{name}.weight": (out, into, side, side), f"{name}.bias": (out,)}
    return found


def first_weights(rng: np.random.Generator) -> Weights:
    """Draw weights after He et al. (2015); the last layer is 0, so the net begins by no change."""
    drawn: Weights = {}
    for name, shape in shapes().items():
        scale = np.sqrt(2 / np.prod(shape[1:])) if len(shape) > 1 else 0.0
        drawn[name] = (scale * rng.standard_normal(shape)).astype(np.float32)
    drawn["out.weight"][:] = 0
    return drawn


def run(weights: dict[str, Tensor], x: Tensor) -> Tensor:
    """Run the net on (B, INPUTS, R, C), R and C multiples of `STRIDE`; (B, OUTPUTS, R, C)."""
    from torch.nn.functional import avg_pool2d, conv2d, interpolate, silu

    def convolve(x: Tensor, name: str) -> Tensor:
        kernel = weights[f"{name}.weight"]
        return conv2d(x, kernel, weights[f"{name}.bias"], padding=kernel.shape[-1] // 2)

    def act(x: Tensor, *names: str) -> Tensor:
        for name in names:
            x = silu(convolve(x, name))
        return x

    levels = [act(x, "down0a", "down0b")]
    for name in ("down1", "down2"):
        levels.append(act(avg_pool2d(levels[-1], 2), f"{name}a", f"{name}b"))
    up = act(avg_pool2d(levels[-1], 2), "down3a", "down3b", "down3c")
    for number in (2, 1, 0):
        grown = interpolate(convolve(up, f"link{number}"), scale_factor=2.0, mode="nearest")
        up = act(levels[number] + grown, f"up{number}")
    return convolve(up, "out")


def mixed(out: Any, windows: Any, size: Any) -> tuple[Any, Any]:
    """Motion left over and change of ln σ, (B, 2, R, C) each, from what the net gives.

    Parameters
    ----------
    out : (B, OUTPUTS, R, C), of NumPy or torch as the others are
    windows : (B, 2, PARTS, R, C), px
    size : (B, R, C), px
    """
    parts = out.reshape(len(out), 2, EACH, *out.shape[2:])
    count = windows.shape[2]
    moved = (parts[:, :, :count] * windows).sum(2) + size[:, None] * parts[:, :, count]
    return moved, parts[:, :, count + 1].clip(-LOGARITHM, LOGARITHM)

"""A small U-Net on tiles: convolutions at three scales, in torch or from plain arrays."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from models.arrays import F32

if TYPE_CHECKING:
    from torch import Tensor

WIDTHS = (16, 32, 64)
INPUTS, OUTPUTS = 9, 6
STRIDE = 4  # tiles: rows and columns must be a multiple

Weights = dict[str, F32]


def shapes(widths: tuple[int, ...] = WIDTHS) -> dict[str, tuple[int, ...]]:
    """Shapes of all weights by name: each convolution (out, in, 3, 3) and its biases."""
    fine, middle, coarse = widths
    convolutions = {
        "down0a": (fine, INPUTS), "down0b": (fine, fine),
        "down1a": (middle, fine), "down1b": (middle, middle),
        "down2a": (coarse, middle), "down2b": (coarse, coarse), "down2c": (coarse, coarse),
        "up1a": (middle, coarse + middle), "up1b": (middle, middle),
        "up0a": (fine, middle + fine), "up0b": (fine, fine), "out": (OUTPUTS, fine),
    }  # fmt: skip
    found: dict[str, tuple[int, ...]] = {}
    for name, (out, into) in convolutions.items():
        found |= {f"{name}.weight": (out, into, 3, 3), f"{name}.bias": (out,)}
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
    from torch import cat, nn

    act, grow = nn.functional.silu, nn.functional.interpolate

    def convolve(x: Tensor, name: str) -> Tensor:
        kernel, bias = weights[f"{name}.weight"], weights[f"{name}.bias"]
        return nn.functional.conv2d(x, kernel, bias, padding=1)

    fine = act(convolve(act(convolve(x, "down0a")), "down0b"))
    middle = nn.functional.avg_pool2d(fine, 2)
    middle = act(convolve(act(convolve(middle, "down1a")), "down1b"))
    coarse = nn.functional.avg_pool2d(middle, 2)
    for name in ("down2a", "down2b", "down2c"):
        coarse = act(convolve(coarse, name))
    middle = cat([grow(coarse, scale_factor=2.0, mode="nearest"), middle], 1)
    middle = act(convolve(act(convolve(middle, "up1a")), "up1b"))
    fine = cat([grow(middle, scale_factor=2.0, mode="nearest"), fine], 1)
    fine = act(convolve(act(convolve(fine, "up0a")), "up0b"))
    return convolve(fine, "out")

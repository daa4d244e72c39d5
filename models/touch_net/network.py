"""The two small nets of the touch net, in operators that NumPy and torch share by name.

The first proposes touches for each number of them from the maps; the second looks at how proposals
fit, and says how likely each number is, and how the touches scatter about their fit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from models.arrays import F32
from models.touch_net.maps import INPUTS
from models.touch_net.prior import MAX_TOUCHES

if TYPE_CHECKING:
    from torch import Tensor

Weights = dict[str, F32]

WIDTH = 320  # neurons of the layers that propose
SLOTS = (
    MAX_TOUCHES * (MAX_TOUCHES + 1) // 2
)  # touches that are proposed: one, then two, three and four
COUNT_FEATURES, COUNT_WIDTH = 32, 64
TOUCH_FEATURES, TOUCH_WIDTH = 27, 64
PARTS = 4  # normal distributions that are mixed
EACH = 10  # numbers of a part: weight, mean (3), factor (6)

PROPOSE = ("propose0", "propose1", "propose2")
COUNT = ("count0", "count1")
TOUCH = ("touch0", "touch1")


def shapes() -> dict[str, tuple[int, ...]]:
    """Shape of every weight by its name; matrices are (out, in)."""
    layers = {
        "propose0": (WIDTH, INPUTS),
        "propose1": (WIDTH, WIDTH),
        "propose2": (WIDTH, WIDTH),
        "propose": (3 * SLOTS + MAX_TOUCHES + 1, WIDTH),
        "count0": (COUNT_WIDTH, COUNT_FEATURES),
        "count1": (COUNT_WIDTH, COUNT_WIDTH),
        "count": (MAX_TOUCHES + 1, COUNT_WIDTH),
        "touch0": (TOUCH_WIDTH, TOUCH_FEATURES),
        "touch1": (TOUCH_WIDTH, TOUCH_WIDTH),
        "touch": (EACH * PARTS, TOUCH_WIDTH),
    }
    every: dict[str, tuple[int, ...]] = {}
    for name, (out, into) in layers.items():
        every |= {f"{name}.weight": (out, into), f"{name}.bias": (out,)}
    return every


def first_weights(rng: np.random.Generator) -> Weights:
    """Draw weights of He; the last layers begin small."""
    last = {"propose": 0.1, "count": 0.1, "touch": 0.1}
    weights: Weights = {}
    for name, shape in shapes().items():
        layer = name.partition(".")[0]
        size = last.get(layer, 1.0) * np.sqrt(2.0 / shape[-1]) if len(shape) == 2 else 0.0
        weights[name] = (size * rng.standard_normal(shape)).astype(np.float32)
    return weights


def run(weights: Weights, hidden: tuple[str, ...], out: str, x: F32) -> F32:
    """Run layers `hidden` with SiLU between, and the layer `out`, on rows (…, in)."""
    for name in hidden:
        x = x @ weights[f"{name}.weight"].T
        x += weights[f"{name}.bias"]
        x *= np.float32(0.5)
        gate = np.tanh(x)
        gate += np.float32(1.0)
        x *= gate
    return x @ weights[f"{out}.weight"].T + weights[f"{out}.bias"]


def run_torch(weights: dict[str, Tensor], hidden: tuple[str, ...], out: str, x: Tensor) -> Tensor:
    """Do as `run` does, with gradients."""
    from torch.nn.functional import linear, silu

    for name in hidden:
        x = silu(linear(x, weights[f"{name}.weight"], weights[f"{name}.bias"]))
    return linear(x, weights[f"{out}.weight"], weights[f"{out}.bias"])

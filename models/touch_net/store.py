"""Storage of touch nets: plain arrays, options as JSON and a checksum, in one npz."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from models.arrays import F32
from models.nets.array_file import NetKind, load_arrays, save_arrays
from models.touch_net.maps import PLACES
from models.touch_net.network import Weights, shapes
from models.touch_net.prior import TouchRange

FORMAT, VERSION = "touchplate touch net", 1


@dataclass(frozen=True, eq=False)
class TouchNet:
    """A trained touch net.

    Attributes
    ----------
    weights : dict of float32 arrays
        By the names of `models.touch_net.network.shapes`.
    touches : TouchRange
        Touches that it was trained on.
    low, high : (257,) float32
        Least and largest of `signature` over the benches of the training.
    about : dict
        Bench, seed, steps and CPU seconds of the training, as plain values.
    """

    weights: Weights
    touches: TouchRange
    low: F32
    high: F32
    about: dict[str, Any]


def save_touch_net(path: str | Path, net: TouchNet) -> None:
    """Write a net aside and rename it.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    arrays = net.weights | {"low": net.low, "high": net.high}
    touches = [net.touches.size, net.touches.margin, net.touches.force]
    save_arrays(path, _kind(), arrays, {"about": net.about, "touches": touches})


def load_touch_net(path: str | Path) -> TouchNet:
    """Read what `save_touch_net` wrote.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        It is damaged, of another version or something else.
    """
    bounds = dict.fromkeys(("low", "high"), (PLACES + 1,))
    arrays, said = load_arrays(path, _kind(), shapes() | bounds)
    (a, b), margin, (low, high) = said["touches"]
    touches = TouchRange((float(a), float(b)), float(margin), (float(low), float(high)))
    weights: Weights = {name: arrays[name] for name in shapes()}
    return TouchNet(weights, touches, arrays["low"], arrays["high"], said["about"])


def _kind() -> NetKind:
    return NetKind(FORMAT, VERSION, "train one by 'touchplate train touch-net'")

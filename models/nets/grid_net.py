"""What nets on grids have in common: their file, and the range of what training has seen."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from models.arrays import F32
from models.nets.array_file import NetKind, load_arrays, save_arrays

_BOUNDS = ("low", "high")


@dataclass(frozen=True, eq=False)
class GridNet:
    """A trained net on a grid.

    Attributes
    ----------
    weights : dict of float32 arrays
        By the names of the shapes of its kind.
    low, high : (C, 1, 1) float32
        Least and largest of each input that training has seen.
    about : dict
        Seed, steps and CPU seconds of the training, as plain values.
    """

    weights: dict[str, F32]
    low: F32
    high: F32
    about: dict[str, Any]


_Net = TypeVar("_Net", bound=GridNet)


def save_grid_net(path: str | Path, kind: NetKind, net: GridNet) -> None:
    """Write a net aside and rename it.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    arrays = net.weights | {"low": net.low, "high": net.high}
    save_arrays(path, kind, arrays, {"about": net.about})


def load_grid_net(
    net: type[_Net],
    path: str | Path,
    kind: NetKind,
    shapes: Mapping[str, tuple[int, ...]],
    inputs: int,
) -> _Net:
    """Read what `save_grid_net` wrote of a net with weights of these shapes and so many inputs.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        It is damaged, of another version or something else.
    """
    bounds = dict.fromkeys(_BOUNDS, (inputs, 1, 1))
    arrays, said = load_arrays(path, kind, dict(shapes) | bounds)
    low, high = (arrays.pop(name) for name in _BOUNDS)
    return net({name: arrays[name] for name in shapes}, low, high, said["about"])


def input_range(channels: int, inputs: Iterable[F32]) -> tuple[F32, F32]:
    """Find the least and the largest of each channel, (C, 1, 1) float32 each.

    Parameters
    ----------
    channels : int
        C.
    inputs : iterable of (..., C, R, K) float32
    """
    low, high = (np.full((channels, 1, 1), far, np.float32) for far in (np.inf, -np.inf))
    for each in inputs:
        stack = each.reshape(-1, *each.shape[-3:])
        low = np.minimum(low, stack.min(axis=(0, 2, 3))[:, None, None])
        high = np.maximum(high, stack.max(axis=(0, 2, 3))[:, None, None])
    return low, high

"""Storage of field nets: plain arrays, options as JSON and a checksum, in one npz."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from models.arrays import F32
from models.field_net.unet import INPUTS, Weights, shapes
from models.nets.array_file import NetKind
from models.nets.grid_net import GridNet, load_grid_net, save_grid_net

FORMAT, VERSION = "touchplate field net", 1
TRAIN = "train one by 'touchplate train dic-net'"


@dataclass(frozen=True, eq=False)
class FieldNet:
    """A trained field net.

    Attributes
    ----------
    weights : dict of float32 arrays
        By the names of `models.field_net.unet.shapes`.
    low, high : (9, 1, 1) float32
        Least and largest of each input that training has seen.
    about : dict
        Seed, steps and CPU seconds of the training, as plain values.
    """

    weights: Weights
    low: F32
    high: F32
    about: dict[str, Any]


def save_field_net(path: str | Path, net: FieldNet) -> None:
    """Write a net aside and rename it.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    save_grid_net(path, _kind(TRAIN), GridNet(net.weights, net.low, net.high, net.about))


def load_field_net(path: str | Path, remedy: str = TRAIN) -> FieldNet:
    """Read what `save_field_net` wrote.

    Parameters
    ----------
    path : path
    remedy : str
        What the errors say is to be done.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        It is damaged, of another version or something else.
    """
    return FieldNet(*load_grid_net(path, _kind(remedy), shapes(), INPUTS))


def _kind(remedy: str) -> NetKind:
    return NetKind(FORMAT, VERSION, remedy)

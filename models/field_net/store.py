"""Storage of field nets: plain arrays, options as JSON and a checksum, in one npz."""

from __future__ import annotations

from pathlib import Path

from models.field_net.unet import INPUTS, shapes
from models.nets.array_file import NetKind
from models.nets.grid_net import GridNet, load_grid_net, save_grid_net

FORMAT, VERSION = "touchplate field net", 1
TRAIN = "train one by 'touchplate train dic-net'"


class FieldNet(GridNet):
    """A trained field net, of the weights that `models.field_net.unet` names."""


def save_field_net(path: str | Path, net: FieldNet) -> None:
    """Write a net aside and rename it.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    save_grid_net(path, _kind(TRAIN), net)


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
    return load_grid_net(FieldNet, path, _kind(remedy), shapes(), INPUTS)


def _kind(remedy: str) -> NetKind:
    return NetKind(FORMAT, VERSION, remedy)

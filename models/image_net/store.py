"""Storage of image nets: plain arrays, options as JSON and a checksum, in one npz."""

from __future__ import annotations

from pathlib import Path

from models.image_net.features import INPUTS
from models.image_net.network import shapes
from models.nets.array_file import NetKind
from models.nets.grid_net import GridNet, load_grid_net, save_grid_net

FORMAT, VERSION = "touchplate image net", 1
TRAIN = "train one by 'touchplate train image-net'"


class ImageNet(GridNet):
    """A trained image net, of the weights that `models.image_net.network` names."""


def save_image_net(path: str | Path, net: ImageNet) -> None:
    """Write a net aside and rename it.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    save_grid_net(path, _kind(TRAIN), net)


def load_image_net(path: str | Path, remedy: str = TRAIN) -> ImageNet:
    """Read what `save_image_net` wrote.

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
    return load_grid_net(ImageNet, path, _kind(remedy), shapes(), INPUTS)


def _kind(remedy: str) -> NetKind:
    return NetKind(FORMAT, VERSION, remedy)

"""The image net as an ONNX file, for programs that run nets and know nothing of this one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from models.image_net.features import INPUTS
from models.image_net.network import OUTPUTS
from models.image_net.store import ImageNet
from models.nets.onnx import write_model
from models.nets.onnx_convolutions import Convolutions

if TYPE_CHECKING:
    from onnx import ModelProto


def write_image_onnx(path: str | Path, net: ImageNet) -> None:
    """Write an image net to a file that ONNX runtimes read.

    Its input "pair" is (N, INPUTS, R, C) float32, R and C multiples of 8, as of
    `models.image_net.features.pair_features`, and its output "mixture" (N, OUTPUTS, R, C), as
    `models.image_net.network.mixed` takes it.

    Raises
    ------
    ValueError
        onnx is not installed.
    OSError
        The file cannot be written.
    """
    write_model(path, image_onnx(net))


def image_onnx(net: ImageNet) -> ModelProto:
    """Return the graph of an image net: the operators of `models.image_net.network.run`.

    Raises
    ------
    ValueError
        onnx is not installed.
    """
    graph = Convolutions()
    levels = [graph.active("pair", "down0a", "down0b")]
    for name in ("down1", "down2"):
        levels.append(graph.active(graph.halved(levels[-1]), f"{name}a", f"{name}b"))
    up = graph.active(graph.halved(levels[-1]), "down3a", "down3b", "down3c")
    for number in (2, 1, 0):
        link = graph.convolved(up, f"link{number}", f"link{number}.sum", side=1)
        up = graph.active(graph.sum(graph.doubled(link), levels[number]), f"up{number}")
    graph.convolved(up, "out", "mixture", side=1)
    return graph.model("image net", net.weights, ("pair", INPUTS), ("mixture", OUTPUTS))

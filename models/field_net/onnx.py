"""The field net as an ONNX file, for programs that run nets and know nothing of this one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from models.field_net.store import FieldNet
from models.field_net.unet import INPUTS, OUTPUTS
from models.nets.onnx import write_model
from models.nets.onnx_convolutions import Convolutions

if TYPE_CHECKING:
    from onnx import ModelProto


def write_field_onnx(path: str | Path, net: FieldNet) -> None:
    """Write a field net to a file that ONNX runtimes read.

    Its input "tiles" is (N, 9, R, C) float32, R and C multiples of 4, as of `net_inputs`, and
    its output "corrections" (N, 6, R, C).

    Raises
    ------
    ValueError
        onnx is not installed.
    OSError
        The file cannot be written.
    """
    write_model(path, field_onnx(net))


def field_onnx(net: FieldNet) -> ModelProto:
    """Return the graph of a field net.

    Raises
    ------
    ValueError
        onnx is not installed.
    """
    graph = Convolutions()
    fine = graph.active("tiles", "down0a", "down0b")
    middle = graph.active(graph.halved(fine), "down1a", "down1b")
    coarse = graph.active(graph.halved(middle), "down2a", "down2b", "down2c")
    middle = graph.active(graph.joined(graph.doubled(coarse), middle), "up1a", "up1b")
    fine = graph.active(graph.joined(graph.doubled(middle), fine), "up0a", "up0b")
    graph.convolved(fine, "out", "corrections")
    return graph.model("field net", net.weights, ("tiles", INPUTS), ("corrections", OUTPUTS))

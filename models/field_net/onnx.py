"""The field net as an ONNX file, for programs that run nets and know nothing of this one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from models.field_net.store import FieldNet
from models.field_net.unet import INPUTS, OUTPUTS
from models.nets.onnx import require_onnx, write_model

if TYPE_CHECKING:
    from onnx import ModelProto, NodeProto

_OPSET, _FILE = 18, 9  # of the operators and of the file; runtimes refuse what is newer


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
    require_onnx()
    from onnx import TensorProto, checker, helper, numpy_helper

    nodes = _nodes()
    size: list[str | int] = ["N", INPUTS, "R", "C"]
    inputs = helper.make_tensor_value_info("tiles", TensorProto.FLOAT, size)
    size[1] = OUTPUTS
    outputs = helper.make_tensor_value_info("corrections", TensorProto.FLOAT, size)
    constants = [numpy_helper.from_array(array, name) for name, array in net.weights.items()]
    constants.append(numpy_helper.from_array(np.array([1, 1, 2, 2], np.float32), "twice"))
    graph = helper.make_graph(nodes, "field net", [inputs], [outputs], constants)
    model = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", _OPSET)], ir_version=_FILE
    )
    checker.check_model(model)  # pyright: ignore[reportUnknownMemberType]
    return model


def _nodes() -> list[NodeProto]:
    """Operators of `models.field_net.unet.run`, in its order."""
    nodes: list[NodeProto] = []
    fine = _pair(nodes, "tiles", "down0a", "down0b")
    middle = _pair(nodes, _halved(nodes, fine), "down1a", "down1b")
    coarse = _halved(nodes, middle)
    for name in ("down2a", "down2b", "down2c"):
        coarse = _active(nodes, coarse, name)
    middle = _pair(nodes, _joined(nodes, coarse, middle), "up1a", "up1b")
    fine = _pair(nodes, _joined(nodes, middle, fine), "up0a", "up0b")
    _convolved(nodes, fine, "out", "corrections")
    return nodes


def _add(nodes: list[NodeProto], kind: str, inputs: list[str], out: str, **options: Any) -> str:
    from onnx import helper

    nodes.append(helper.make_node(kind, inputs, [out], **options))
    return out


def _convolved(nodes: list[NodeProto], x: str, name: str, out: str) -> str:
    inputs = [x, f"{name}.weight", f"{name}.bias"]
    return _add(nodes, "Conv", inputs, out, kernel_shape=[3, 3], pads=[1, 1, 1, 1])


def _active(nodes: list[NodeProto], x: str, name: str) -> str:
    x = _convolved(nodes, x, name, f"{name}.sum")
    return _add(nodes, "Mul", [x, _add(nodes, "Sigmoid", [x], f"{name}.gate")], f"{name}.value")


def _pair(nodes: list[NodeProto], x: str, first: str, second: str) -> str:
    return _active(nodes, _active(nodes, x, first), second)


def _halved(nodes: list[NodeProto], x: str) -> str:
    return _add(nodes, "AveragePool", [x], f"{x}.half", kernel_shape=[2, 2], strides=[2, 2])


def _joined(nodes: list[NodeProto], x: str, beside: str) -> str:
    modes = {
        "mode": "nearest",
        "coordinate_transformation_mode": "asymmetric",
        "nearest_mode": "floor",
    }
    grown = _add(nodes, "Resize", [x, "", "twice"], f"{x}.twice", **modes)
    return _add(nodes, "Concat", [grown, beside], f"{x}.joined", axis=1)

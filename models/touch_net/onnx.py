"""The learned layers of a touch net as an ONNX file, for programs that run nets."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from models.nets.onnx import require_onnx, write_model
from models.touch_net.maps import INPUTS
from models.touch_net.network import COUNT, COUNT_FEATURES, PROPOSE, TOUCH, TOUCH_FEATURES
from models.touch_net.store import TouchNet

if TYPE_CHECKING:
    from onnx import ModelProto, NodeProto

_OPSET, _FILE = 18, 9  # of the operators and of the file; runtimes refuse what is newer
_WAYS = (
    ("maps", INPUTS, PROPOSE, "propose", "proposals"),
    ("fits", COUNT_FEATURES, COUNT, "count", "numbers"),
    ("touches", TOUCH_FEATURES, TOUCH, "touch", "scatter"),
)
"""Input, its numbers, hidden layers, last layer, output."""


def write_touch_onnx(path: str | Path, net: TouchNet) -> None:
    """Write the learned layers of a touch net to a file that ONNX runtimes read.

    Inputs are rows of float32: "maps" (N, 513) of `prepare_maps`, "fits" (N, 32) of
    `count_features` and "touches" (N, 27) of `touch_features`; outputs "proposals" (N, 35),
    "numbers" (N, 5) and "scatter" (N, 40). The steps between them are arithmetic, in no file.

    Raises
    ------
    ValueError
        onnx is not installed.
    OSError
        The file cannot be written.
    """
    write_model(path, touch_onnx(net))


def touch_onnx(net: TouchNet) -> ModelProto:
    """Return the graph of a touch net's learned layers.

    Raises
    ------
    ValueError
        onnx is not installed.
    """
    require_onnx()
    from onnx import TensorProto, ValueInfoProto, checker, helper, numpy_helper

    nodes: list[NodeProto] = []
    inputs, outputs = list[ValueInfoProto](), list[ValueInfoProto]()
    for name, size, hidden, last, out in _WAYS:
        rows = f"{name}_rows"
        nodes += _layers(name, hidden, last, out)
        inputs.append(helper.make_tensor_value_info(name, TensorProto.FLOAT, [rows, size]))
        given = len(net.weights[f"{last}.bias"])
        outputs.append(helper.make_tensor_value_info(out, TensorProto.FLOAT, [rows, given]))
    constants = [numpy_helper.from_array(array, name) for name, array in net.weights.items()]
    graph = helper.make_graph(nodes, "touch net", inputs, outputs, constants)
    model = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", _OPSET)], ir_version=_FILE
    )
    checker.check_model(model)  # pyright: ignore[reportUnknownMemberType]
    return model


def _layers(x: str, hidden: tuple[str, ...], last: str, out: str) -> list[NodeProto]:
    """Operators of `models.touch_net.network.run`, in its order."""
    from onnx import helper

    nodes: list[NodeProto] = []
    for name in (*hidden, last):
        given = [x, f"{name}.weight", f"{name}.bias"]
        x = out if name == last else f"{name}.sum"
        nodes.append(helper.make_node("Gemm", given, [x], transB=1))
        if name != last:
            nodes.append(helper.make_node("Sigmoid", [x], [f"{name}.gate"]))
            nodes.append(helper.make_node("Mul", [x, f"{name}.gate"], [f"{name}.value"]))
            x = f"{name}.value"
    return nodes

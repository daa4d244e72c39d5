"""Nets as ONNX files, for programs that run nets and know nothing of this one."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from models.nets.net import Net

if TYPE_CHECKING:
    from onnx import ModelProto, NodeProto

# Of the operators and of the file; runtimes refuse files newer than themselves.
_OPSET = 18
_FILE = 9


def write_onnx(path: str | Path, net: Net) -> None:
    """Write a net to a file that ONNX runtimes read.

    Its input "strain" is (N, I) float64, scaled inside; its output "targets" is (N, D) float64.

    Raises
    ------
    ValueError
        As `to_onnx`.
    OSError
        When the file cannot be written.
    """
    model = to_onnx(net)
    try:
        Path(path).write_bytes(model.SerializeToString())
    except OSError as error:
        raise OSError(
            f"ONNX file {path} cannot be written ({error.strerror or error}); choose another place"
        ) from error


def to_onnx(net: Net) -> ModelProto:
    """Return the graph of a net in double precision.

    Raises
    ------
    ValueError
        When onnx is not installed, or the net reports touches without an order.
    """
    if find_spec("onnx") is None:
        raise ValueError("onnx is not installed and the export needs it; run 'pip install onnx'")
    if net.options.poles:
        raise ValueError(
            "a net that reports touches without an order cannot be exported, ONNX finds no roots "
            "of polynomials; train one with poles = 0"
        )
    from onnx import TensorProto, checker, helper, numpy_helper

    graph = _Graph([], {})
    out = graph.layers(net, graph.scaled(net, "strain"))
    inputs = helper.make_tensor_value_info(
        "strain", TensorProto.DOUBLE, ["N", len(net.scaling.centre)]
    )
    outputs = helper.make_tensor_value_info(out, TensorProto.DOUBLE, ["N", len(net.layers[-1][1])])
    constants = [numpy_helper.from_array(array, name) for name, array in graph.constants.items()]
    body = helper.make_graph(graph.nodes, "net", [inputs], [outputs], constants)
    model = helper.make_model(
        body, opset_imports=[helper.make_opsetid("", _OPSET)], ir_version=_FILE
    )
    checker.check_model(model)  # pyright: ignore[reportUnknownMemberType]
    return model


class _Graph:
    """Operators one after another, each named by its number."""

    def __init__(self, nodes: list[NodeProto], constants: dict[str, np.ndarray]) -> None:
        self.nodes, self.constants = nodes, constants

    def apply(self, kind: str, *inputs: str | np.ndarray | float, name: str = "") -> str:
        """Add an operator; arrays become constants."""
        from onnx import helper

        names = [each if isinstance(each, str) else self._constant(each) for each in inputs]
        out = name or f"value{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, names, [out]))
        return out

    def _constant(self, array: np.ndarray | float) -> str:
        name = f"constant{len(self.constants)}"
        self.constants[name] = np.asarray(array, dtype=np.float64)
        return name

    def scaled(self, net: Net, strain: str) -> str:
        """Add what `models.nets.net.scale_strain` does."""
        if net.scaling.knee is not None:
            # asinh x = sign x · ln(|x| + √(x² + 1)): runtimes have Asinh in float32 alone.
            x = self.apply("Div", strain, net.scaling.knee)
            root = self.apply("Sqrt", self.apply("Add", self.apply("Mul", x, x), 1.0))
            size = self.apply("Log", self.apply("Add", self.apply("Abs", x), root))
            strain = self.apply("Mul", self.apply("Sign", x), size)
        if net.scaling.relative:
            squares = self.apply("Mul", strain, strain)
            along = self.apply("MatMul", squares, np.ones((len(net.scaling.centre), 1)))
            # Strains that are all 0 stay 0; no other norm is as small as that.
            norm = self.apply("Max", self.apply("Sqrt", along), np.finfo(np.float64).tiny)
            strain = self.apply("Div", strain, norm)
        return self.apply("Div", self.apply("Sub", strain, net.scaling.centre), net.scaling.scale)

    def layers(self, net: Net, x: str) -> str:
        """Add what `models.nets.net.forward` does."""
        *hidden, (weights, biases) = net.layers
        for hidden_weights, hidden_biases in hidden:
            x = self.apply("Add", self.apply("MatMul", x, hidden_weights), hidden_biases)
            match net.options.activation:
                case "relu":
                    x = self.apply("Max", x, 0.0)
                case "tanh":
                    x = self.apply("Tanh", x)
                case "silu":
                    x = self.apply("Mul", x, self.apply("Sigmoid", x))
        return self.apply("Add", self.apply("MatMul", x, weights), biases, name="targets")

"""Nets as ONNX files, for programs that run nets and know nothing of this one."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from models.nets.net import Net
from models.nets.onnx_roots import decode
from models.nets.store import Model
from models.nets.train import Trained
from models.nets.two_step import TrainedTwoStep, TwoStep

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
    write_model(path, to_onnx(net))


def write_model_onnx(path: str | Path, model: Model) -> None:
    """Write any trained model that is made of nets; as `write_onnx`.

    A net of two steps has a second input, "before", the strain before the touch.

    Raises
    ------
    ValueError
        As `to_onnx`, or for a regression.
    OSError
        When the file cannot be written.
    """
    match model:
        case Trained(net=net):
            write_model(path, to_onnx(net))
        case TrainedTwoStep():
            write_model(path, two_step_to_onnx(model.nets))
        case _:
            raise ValueError(
                "a regression is no net and cannot be exported to ONNX; leave --onnx out"
            )


def to_onnx(net: Net) -> ModelProto:
    """Return the graph of a net in double precision.

    Raises
    ------
    ValueError
        When onnx is not installed.
    """
    require_onnx()
    graph, poles, reported = Graph([], {}), net.options.poles, len(net.layers[-1][1])
    out = graph.layers(net, graph.scaled(net, "strain"), "" if poles else "targets")
    columns = reported
    if poles:
        magnitudes = reported > 2 * poles
        out, columns = decode(graph, out, poles, magnitudes), (2 + magnitudes) * poles
    return graph.model({"strain": len(net.scaling.centre)}, out, columns)


def two_step_to_onnx(nets: TwoStep) -> ModelProto:
    """Return the graph of a net of two steps in double precision; raises as `to_onnx`."""
    require_onnx()
    graph, gauges = Graph([], {}), len(nets.shape.scaling.centre)
    base = graph.layers(nets.shape, graph.scaled(nets.shape, "before"))
    seen = "strain"
    if nets.strain != "total":
        seen = graph.apply("Sub", "strain", "before")
    if nets.strain == "direction":
        seen = graph.over_norm(seen, gauges)
    fed = graph.apply("Concat", base, seen, axis=1)
    out = graph.layers(nets.place, graph.scaled(nets.place, fed), "targets")
    return graph.model({"before": gauges, "strain": gauges}, out, len(nets.place.layers[-1][1]))


def require_onnx() -> None:
    """Refuse an export where onnx is not installed."""
    if find_spec("onnx") is None:
        raise ValueError("onnx is not installed and the export needs it; run 'pip install onnx'")


def write_model(path: str | Path, model: ModelProto) -> None:
    """Write a graph to a file."""
    try:
        Path(path).write_bytes(model.SerializeToString())
    except OSError as error:
        raise OSError(
            f"ONNX file {path} cannot be written ({error.strerror or error}); choose another place"
        ) from error


class Graph:
    """Operators one after another, each named by its number."""

    def __init__(self, nodes: list[NodeProto], constants: dict[str, np.ndarray]) -> None:
        self.nodes, self.constants = nodes, constants

    def apply(
        self,
        kind: str,
        *inputs: str | np.ndarray | float,
        name: str = "",
        axis: int | None = None,
    ) -> str:
        """Add an operator; arrays become constants, whole ones indices."""
        from onnx import helper

        names = [each if isinstance(each, str) else self._constant(each) for each in inputs]
        out = name or f"value{len(self.nodes)}"
        node = helper.make_node(kind, names, [out])
        if axis is not None:
            node.attribute.append(helper.make_attribute("axis", axis))
        self.nodes.append(node)
        return out

    def smallest_first(self, values: str, count: int) -> str:
        """Return the order (N, count) that sorts the columns of each row."""
        from onnx import helper

        out = f"value{len(self.nodes)}"
        inputs = [values, self._constant(np.array([count]))]
        outputs = [f"{out}sorted", out]
        self.nodes.append(helper.make_node("TopK", inputs, outputs, axis=1, largest=0, sorted=1))
        return out

    def model(self, inputs: dict[str, int], out: str, columns: int) -> ModelProto:
        """Return the whole, checked: its inputs and their columns, its output and those of it."""
        from onnx import TensorProto, checker, helper, numpy_helper

        double, value = TensorProto.DOUBLE, helper.make_tensor_value_info
        fed = [value(name, double, ["N", width]) for name, width in inputs.items()]
        given = [value(out, double, ["N", columns])]
        constants = [numpy_helper.from_array(array, name) for name, array in self.constants.items()]
        body = helper.make_graph(self.nodes, "net", fed, given, constants)
        opset = [helper.make_opsetid("", _OPSET)]
        model = helper.make_model(body, opset_imports=opset, ir_version=_FILE)
        checker.check_model(model)  # pyright: ignore[reportUnknownMemberType]
        return model

    def _constant(self, array: np.ndarray | float) -> str:
        name = f"constant{len(self.constants)}"
        whole = isinstance(array, np.ndarray) and array.dtype.kind == "i"
        self.constants[name] = np.asarray(array, dtype=np.int64 if whole else np.float64)
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
            strain = self.over_norm(strain, len(net.scaling.centre))
        return self.apply("Div", self.apply("Sub", strain, net.scaling.centre), net.scaling.scale)

    def over_norm(self, strain: str, columns: int) -> str:
        """Add the division of each row by its norm."""
        squares = self.apply("Mul", strain, strain)
        along = self.apply("MatMul", squares, np.ones((columns, 1)))
        # Strains that are all 0 stay 0; no other norm is as small as that.
        norm = self.apply("Max", self.apply("Sqrt", along), np.finfo(np.float64).tiny)
        return self.apply("Div", strain, norm)

    def layers(self, net: Net, x: str, name: str = "") -> str:
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
        return self.apply("Add", self.apply("MatMul", x, weights), biases, name=name)

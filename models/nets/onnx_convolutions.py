"""Graphs of convolutions with SiLU at several scales, for ONNX files of nets on grids."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from models.arrays import F32
from models.nets.onnx import require_onnx

if TYPE_CHECKING:
    from onnx import ModelProto, NodeProto

_OPSET, _FILE = 18, 9  # of the operators and of the file; runtimes refuse what is newer


class Convolutions:
    """A graph that is put together operator by operator; weights are named as in the net.

    Raises
    ------
    ValueError
        onnx is not installed.
    """

    def __init__(self) -> None:
        require_onnx()
        self._nodes: list[NodeProto] = []

    def convolved(self, x: str, name: str, out: str, side: int = 3) -> str:
        """Convolve by side x side weights, and keep the size."""
        inputs, rim = [x, f"{name}.weight", f"{name}.bias"], side // 2
        return self.add("Conv", inputs, out, kernel_shape=[side, side], pads=4 * [rim])

    def active(self, x: str, *names: str) -> str:
        """Convolve one after the other, each with SiLU."""
        for name in names:
            x = self.convolved(x, name, f"{name}.sum")
            x = self.add("Mul", [x, self.add("Sigmoid", [x], f"{name}.gate")], f"{name}.value")
        return x

    def halved(self, x: str) -> str:
        """Mean over 2 x 2."""
        return self.add("AveragePool", [x], f"{x}.half", kernel_shape=[2, 2], strides=[2, 2])

    def doubled(self, x: str) -> str:
        """Each value four times."""
        modes = {
            "mode": "nearest",
            "coordinate_transformation_mode": "asymmetric",
            "nearest_mode": "floor",
        }
        return self.add("Resize", [x, "", "twice"], f"{x}.twice", **modes)

    def joined(self, x: str, beside: str) -> str:
        """Channels of both."""
        return self.add("Concat", [x, beside], f"{x}.joined", axis=1)

    def sum(self, x: str, beside: str) -> str:
        """Sum of both."""
        return self.add("Add", [x, beside], f"{x}.total")

    def add(self, kind: str, inputs: list[str], out: str, **options: Any) -> str:
        """Add an operator."""
        from onnx import helper

        self._nodes.append(helper.make_node(kind, inputs, [out], **options))
        return out

    def model(
        self,
        name: str,
        weights: Mapping[str, F32],
        given: tuple[str, int],
        found: tuple[str, int],
    ) -> ModelProto:
        """Return the graph from an input (N, channels, R, C) to an output, each by its name."""
        from onnx import TensorProto, checker, helper, numpy_helper

        ends = [
            helper.make_tensor_value_info(end, TensorProto.FLOAT, ["N", channels, "R", "C"])
            for end, channels in (given, found)
        ]
        constants = [numpy_helper.from_array(array, key) for key, array in weights.items()]
        constants.append(numpy_helper.from_array(np.array([1, 1, 2, 2], np.float32), "twice"))
        graph = helper.make_graph(self._nodes, name, ends[:1], ends[1:], constants)
        model = helper.make_model(
            graph, opset_imports=[helper.make_opsetid("", _OPSET)], ir_version=_FILE
        )
        checker.check_model(model)  # pyright: ignore[reportUnknownMemberType]
        return model

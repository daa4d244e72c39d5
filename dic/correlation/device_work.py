"""Work on tensors that a GPU replays as one piece: launching its kernels one by one costs more."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torch import Tensor
    from torch.cuda import CUDAGraph

Work = Callable[..., "tuple[Tensor, ...]"]


class DeviceWork:
    """A function of tensors of fixed shapes, recorded at its first call on a GPU.

    On a processor it is called as it is. It must not wait for the GPU, and what it gives is
    overwritten by the next call.
    """

    def __init__(self, work: Work) -> None:
        self._work = work
        self._graph: CUDAGraph | None = None
        self._given: tuple[Tensor, ...] = ()
        self._found: tuple[Tensor, ...] = ()

    def __call__(self, *given: Tensor) -> tuple[Tensor, ...]:
        """Do the work on these tensors."""
        if not given[0].is_cuda:
            return self._work(*given)
        graph = self._graph or self._record(given)
        for held, now in zip(self._given, given, strict=True):
            held.copy_(now)
        graph.replay()
        return self._found

    def _record(self, given: tuple[Tensor, ...]) -> CUDAGraph:
        import torch

        self._given = tuple(tensor.clone() for tensor in given)
        aside = torch.cuda.Stream()
        aside.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(aside):  # what is made once, such as workspaces, is made here
            self._work(*self._given)
        torch.cuda.current_stream().wait_stream(aside)
        graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(graph):
            self._found = self._work(*self._given)
        self._graph = graph
        return graph

"""A training by descent: Adam, a running mean of the weights, and what a later run needs."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from models.arrays import F32, F64, AnyArray
from models.nets.checkpoint import Checkpoint

if TYPE_CHECKING:
    from torch import Tensor

Weights = dict[str, F32]
Loss = Callable[[dict[str, "Tensor"], str], "Tensor"]
"""From the weights and the device they are on to what is to fall."""

_BETA = (0.9, 0.99)
_GROUPS = ("weights", "mean", "first", "second")


class Descent:
    """Weights, what Adam remembers of them, their mean, and the losses so far.

    Parameters
    ----------
    weights : dict of float32 arrays
    keep : float
        Of the running mean of the weights, a step; it is less over the first steps.
    """

    def __init__(self, weights: Weights, keep: float = 0.998) -> None:
        import torch

        self._keep = keep
        self.device = "cuda" if torch.cuda.is_available() else "cpu"
        self.step, self.seconds = 0, 0.0
        self.history: list[float] = []
        self.weights = {
            name: torch.tensor(array, device=self.device, requires_grad=True)
            for name, array in weights.items()
        }
        self.mean = {name: value.detach().clone() for name, value in self.weights.items()}
        self.first = {name: torch.zeros_like(value) for name, value in self.mean.items()}
        self.second = {name: torch.zeros_like(value) for name, value in self.mean.items()}

    def descend(self, loss: Loss, rate: float) -> float:
        """Take one step of Adam (Kingma and Ba 2015) at a learning rate; gives the loss."""
        import torch

        found = loss(self.weights, self.device)
        found.backward()
        self.step += 1
        low, high = (1 - beta**self.step for beta in _BETA)
        keep = min(self._keep, self.step / (self.step + 10))
        with torch.no_grad():
            for name, value in self.weights.items():
                slope = value.grad
                if slope is None:
                    continue
                slope = slope.clamp(-1.0, 1.0)
                self.first[name].lerp_(slope, 1 - _BETA[0])
                self.second[name].lerp_(slope * slope, 1 - _BETA[1])
                scale = (self.second[name] / high).sqrt() + 1e-8
                value -= rate * (self.first[name] / low) / scale
                self.mean[name].lerp_(value, 1 - keep)
                value.grad = None
        self.history.append(float(found.detach()))
        return self.history[-1]

    def settle(self) -> None:
        """Go on from the mean of the weights."""
        import torch

        with torch.no_grad():
            for name, value in self.weights.items():
                value.copy_(self.mean[name])

    def average(self) -> Weights:
        """Mean of the weights over the last steps."""
        return {name: np.array(value.cpu().numpy()) for name, value in self.mean.items()}

    def arrays(self) -> dict[str, F32 | F64]:
        """Everything from which a run goes on."""
        kept: dict[str, F32 | F64] = {
            "progress": np.array([self.step, self.seconds]),
            "history": np.array(self.history),
        }
        for group in _GROUPS:
            for name, value in getattr(self, group).items():
                kept[f"{group}:{name}"] = np.array(value.detach().cpu().numpy())
        return kept

    def load(self, kept: dict[str, AnyArray] | None) -> None:
        """Go on from what `arrays` kept, if there is anything."""
        import torch

        if kept is None:
            return
        self.step, self.seconds = int(kept["progress"][0]), float(kept["progress"][1])
        self.history = [float(value) for value in kept["history"]]
        with torch.no_grad():
            for group in _GROUPS:
                for name, value in getattr(self, group).items():
                    value.copy_(torch.tensor(kept[f"{group}:{name}"]))


def finish(
    state: Descent,
    steps: int,
    take: Callable[[], float],
    task: str,
    checkpoint: Checkpoint | None,
    on_step: Callable[[int, float], None] | None,
    seconds: Callable[[], float],
) -> None:
    """Take the steps that a training still needs; a run of the same task goes on from its file.

    Parameters
    ----------
    state : Descent
    steps : int
        In all.
    take : callable
        Takes one step and gives its loss.
    task : str
        Names what is trained, see `models.nets.checkpoint.fingerprint`.
    checkpoint : Checkpoint or None
    on_step : callable or None
        Is given the number of the step and its loss.
    seconds : callable
        CPU time since this run began, s.
    """
    if checkpoint is not None:
        state.load(checkpoint.load(task))
    before = state.seconds
    while state.step < steps:
        found = take()
        state.seconds = before + seconds()
        if on_step is not None:
            on_step(state.step, found)
        if checkpoint is not None and state.step % checkpoint.every == 0:
            checkpoint.save(state.arrays() | {"task": np.array(task)})


def fall(progress: float, first: float = 0.0) -> float:
    """Fraction of the learning rate: it rises over the first fiftieth, then falls as a cosine.

    Parameters
    ----------
    progress : float
        From 0 to 1 over the training.
    first : float
        More of it while it rises: what a step at progress 0 takes.
    """
    return min(1.0, 50 * progress + first) * 0.5 * (1 + float(np.cos(np.pi * min(progress, 1.0))))

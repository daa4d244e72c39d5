"""The steps of a training: Adam on batches, then L-BFGS in double precision, on torch tensors."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING, Protocol

import numpy as np

from models.data.dataset import Dataset
from models.nets.checkpoint import Checkpoint
from models.nets.net import Scaling, forward, scale_strain
from models.nets.recipe import Recipe

if TYPE_CHECKING:
    from torch import Tensor

    from models.nets.loss import Loss

    Layers = list[tuple[Tensor, Tensor]]
    Pairs = tuple[Tensor, Tensor]

# What Adam remembers of each parameter.
_MOMENTS = ("step", "exp_avg", "exp_avg_sq")


class Descendable(Protocol):
    """What Adam needs of a net: its loss, and what its layers report."""

    @property
    def loss(self) -> "Loss":
        """Of what is reported, and the targets."""
        ...

    def predict(self, layers: "Layers", inputs: "Tensor") -> "Tensor":
        """Return targets in their units."""
        ...


@dataclass(frozen=True, eq=False)
class TrainingTask:
    """What turns data into tensors, and tensors into a loss."""

    scale: Scaling
    live: np.ndarray
    outputs: Scaling
    activation: str
    loss: "Loss"
    device: str = "cpu"

    def tensors(self, data: Dataset, kind: str = "float32") -> "Pairs":
        """Scaled live inputs, and targets."""
        import torch

        inputs = scale_strain(self.scale, data.strain[:, self.live])
        dtype, device = getattr(torch, kind), self.device
        return (
            torch.tensor(inputs, dtype=dtype, device=device),
            torch.tensor(data.targets, dtype=dtype, device=device),
        )

    def predict(self, layers: "Layers", inputs: "Tensor") -> "Tensor":
        """Return targets in their units."""
        import torch

        act = getattr(torch.nn.functional, self.activation)
        centre, scale = (each.to(inputs.dtype) for each in self.units)
        return forward(layers, inputs, act) * scale + centre

    @cached_property
    def units(self) -> "Pairs":
        """Centre and scale of the outputs, float64, on the device."""
        import torch

        arrays = self.outputs.centre, self.outputs.scale
        centre, scale = (torch.tensor(each, device=self.device) for each in arrays)
        return centre, scale

    def arrays(self, layers: "Layers") -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """Layers as arrays: with no weight for dead inputs, and the scale of the outputs."""
        arrays = [(_array(weights), _array(biases)) for weights, biases in layers]
        weights, biases = arrays[0]
        first = np.zeros((len(self.live), len(biases)), weights.dtype)
        first[self.live] = weights  # a channel that was dead in training may bring noise
        arrays[0] = first, biases
        weights, biases = arrays[-1]
        scale, centre = self.outputs.scale, self.outputs.centre
        arrays[-1] = (
            (weights * scale).astype(weights.dtype),
            (biases * scale + centre).astype(biases.dtype),
        )
        return tuple(arrays)


class Descent:
    """Layers on their way down: Adam, the losses so far, and what of it is kept."""

    def __init__(
        self, layers: "Layers", recipe: Recipe, checkpoint: Checkpoint | None, task: str
    ) -> None:
        import torch

        self.layers, self.recipe, self.checkpoint, self.task = layers, recipe, checkpoint, task
        self.parameters = [tensor for layer in layers for tensor in layer]
        self.adam = torch.optim.Adam(self.parameters, lr=recipe.learning_rate, fused=True)
        self.epoch = 0
        self.history: list[tuple[float, float]] = []
        kept = checkpoint.load(task) if checkpoint else None
        if kept:
            self._restore(kept)

    def step(self) -> None:
        """Move by the gradients that are there; now and then write down where."""
        self.adam.param_groups[0]["lr"] = self.recipe.rate(self.epoch)
        self.adam.step()
        self.epoch += 1
        if self.checkpoint and self.epoch % self.checkpoint.every == 0:
            self.checkpoint.save(self._arrays())

    def _arrays(self) -> dict[str, np.ndarray]:
        arrays = {
            "task": np.array(self.task),
            "epoch": np.array(self.epoch),
            "history": np.array(self.history),
        }
        for number, tensor in enumerate(self.parameters):
            state = self.adam.state[tensor]
            arrays[f"value{number}"] = _array(tensor)
            arrays |= {f"{key}{number}": _array(state[key]) for key in _MOMENTS}
        return arrays

    def _restore(self, kept: dict[str, np.ndarray]) -> None:
        import torch

        self.epoch = int(kept["epoch"])
        self.history = [(row[0], row[1]) for row in kept["history"].tolist()]
        with torch.no_grad():
            for number, tensor in enumerate(self.parameters):
                tensor.copy_(torch.tensor(kept[f"value{number}"]))
                moments = {
                    key: torch.tensor(kept[f"{key}{number}"], device=tensor.device)
                    for key in _MOMENTS
                }
                self.adam.state[tensor] = moments


def _array(tensor: "Tensor") -> np.ndarray:
    """Return a copy of a tensor of any device."""
    return np.array(tensor.detach().cpu().numpy())


def run_adam(
    descent: Descent,
    stream: Iterator["Pairs"],
    validation: "Pairs",
    task: Descendable,
    on_epoch: Callable[[int, float], None],
) -> np.ndarray:
    """Step the layers of `descent` in place; return the losses of both sets where checked."""
    import torch

    recipe = descent.recipe

    def loss(pairs: "Pairs") -> "Tensor":
        return task.loss(task.predict(descent.layers, pairs[0]), pairs[1])

    # A run that goes on has seen these batches already.
    for inputs, targets in islice(stream, descent.epoch, recipe.epochs):
        descent.adam.zero_grad()
        training = loss((inputs, targets))
        training.backward()
        value, epoch = training.item(), descent.epoch
        if epoch % recipe.check == 0:
            with torch.no_grad():
                descent.history.append((value, loss(validation).item()))
        if not np.isfinite(value):
            raise ValueError(
                f"training loss became {value} mm in epoch {epoch + 1} at a learning "
                f"rate of {recipe.learning_rate:g}; use a smaller one such as 0.001"
            )
        descent.step()
        on_epoch(epoch + 1, value)
    return np.array(descent.history)


def run_lbfgs(layers: "Layers", training: Dataset, task: TrainingTask, max_steps: int) -> "Layers":
    """Go on in double precision, by L-BFGS on the mean square of scaled errors."""
    import torch

    layers = [
        (w.detach().double().requires_grad_(), b.detach().double().requires_grad_())
        for w, b in layers
    ]
    inputs, targets = task.tensors(training, "float64")
    _, unit = task.units
    lbfgs = torch.optim.LBFGS(
        [tensor for layer in layers for tensor in layer],
        max_iter=max_steps,
        history_size=50,
        line_search_fn="strong_wolfe",
        tolerance_grad=1e-14,
        tolerance_change=1e-18,
    )

    def closure() -> float:
        lbfgs.zero_grad()
        square = (((task.predict(layers, inputs) - targets) / unit) ** 2).mean()
        square.backward()
        return square.item()

    lbfgs.step(closure)
    return layers

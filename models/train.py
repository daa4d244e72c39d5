"""Training: Adam on a loss of the paper, and a finish in double precision (torch lives here)."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import repeat
from math import cos, pi
from typing import TYPE_CHECKING, Literal

import numpy as np

from models.dataset import Dataset
from models.loss import distance
from models.net import Net, NetOptions, Scaling, forward, initial, scale_strain, scaling

if TYPE_CHECKING:
    from torch import Tensor

    from models.loss import Loss

    Layers = list[tuple[Tensor, Tensor]]
    Pairs = tuple[Tensor, Tensor]

__all__ = ["BEST", "BEST_NET", "Recipe", "Trained", "train"]


@dataclass(frozen=True)
class Recipe:
    """How long and how fast to descend.

    Attributes
    ----------
    epochs
        Steps of Adam, each over the whole training set or over one batch.
    learning_rate
        Of Adam; the default is that of the library which the paper used.
    decay
        "constant" keeps the learning rate, "cosine" lets it fall to 0 at the end.
    outputs
        "raw" lets the net begin at 0 and grow to the size of its targets; "scaled" begins at
        their mean, with steps in units of their deviation.
    finish
        Most iterations of L-BFGS that follow in double precision, on the mean square over the
        whole training set.
    check
        Epochs between two looks at the validation set.

    Raises
    ------
    ValueError
        When a number is not positive.
    """

    epochs: int = 30000
    learning_rate: float = 1e-3
    decay: Literal["constant", "cosine"] = "constant"
    outputs: Literal["raw", "scaled"] = "raw"
    finish: int = 0
    check: int = 1

    def __post_init__(self) -> None:
        if self.epochs < 1:
            raise ValueError(f"epochs must be at least 1, got {self.epochs}; use 30000")
        if not self.learning_rate > 0.0:
            raise ValueError(
                f"learning rate must be positive, got {self.learning_rate:g}; use 0.001"
            )
        if self.check < 1:
            raise ValueError(f"epochs between checks must be at least 1, got {self.check}; use 1")

    def rate(self, epoch: int) -> float:
        """Return the learning rate of an epoch."""
        match self.decay:
            case "constant":
                return self.learning_rate
            case "cosine":
                return self.learning_rate * 0.5 * (1.0 + cos(pi * epoch / self.epochs))


BEST = Recipe(1000, 3e-3, "cosine", "scaled", finish=2000)
"""What places the paper's touches best of what was tried: 0.02 mm in 10 CPU s."""

BEST_NET = NetOptions((32, 32), "silu", "asinh")
"""The net for `BEST`, of the size of the paper's."""


@dataclass(frozen=True)
class Trained:
    """What training ends in.

    Attributes
    ----------
    net
        After the last epoch.
    history
        (checks, 2) float64: training and validation loss before the steps that were checked
        (figure 2D).
    """

    net: Net
    history: np.ndarray


def train(
    training: Dataset,
    validation: Dataset,
    options: NetOptions,
    recipe: Recipe,
    rng: np.random.Generator,
    on_epoch: Callable[[int, float], None] | None = None,
    loss: "Loss | None" = None,
    batches: Iterator[Dataset] | None = None,
) -> Trained:
    """Train a net on `training`, section 2 of the paper.

    Runs on one thread, where the same generator gives the same net to the last bit.

    Parameters
    ----------
    training, validation
        Only the first is learnt from; it also says how inputs and outputs are scaled.
    options
        Architecture.
    recipe
        Epochs, learning rate, finish.
    rng
        Source of the initial weights.
    on_epoch
        Called with the number of epochs done and the training loss.
    loss
        Equation 1, the distance of one touch, by default.
    batches
        What each epoch learns from, an endless iterator; all of `training` where there is none.

    Raises
    ------
    ValueError
        When the loss stops being finite, or torch is not installed.
    """
    _require_torch()
    scale = scaling(training.strain, options.inputs)
    sizes = (training.strain.shape[1], *options.layers, training.targets.shape[1])
    start = initial(sizes, rng)
    live = training.strain.std(axis=0) > 0.0  # of reading B one input in three; the rest is 0
    fed = Scaling(scale.centre[live], scale.scale[live], scale.knee)
    task = _Task(fed, live, _outputs(training, recipe), options.activation, loss or distance())
    with _one_thread():
        layers = _tensors(start, live)
        fixed = task.tensors(training)
        stream = repeat(fixed) if batches is None else map(task.tensors, batches)
        tell = on_epoch or (lambda epoch, loss: None)
        history = _descend(layers, stream, task.tensors(validation), task, recipe, tell)
        if recipe.finish:
            layers = _finish(layers, training, task, recipe.finish)
    return Trained(Net(options, scale, task.arrays(layers, start)), history)


@dataclass(frozen=True, eq=False)
class _Task:
    """What turns data into tensors, and tensors into a loss."""

    scale: Scaling
    live: np.ndarray
    outputs: Scaling
    activation: str
    loss: "Loss"

    def tensors(self, data: Dataset, kind: str = "float32") -> "Pairs":
        """Scaled live inputs, and targets."""
        import torch

        inputs = scale_strain(self.scale, data.strain[:, self.live])
        dtype = getattr(torch, kind)
        return torch.tensor(inputs, dtype=dtype), torch.tensor(data.targets, dtype=dtype)

    def predict(self, layers: "Layers", inputs: "Tensor") -> "Tensor":
        import torch

        act = getattr(torch.nn.functional, self.activation)
        centre, scale = (
            torch.tensor(array, dtype=inputs.dtype)
            for array in (self.outputs.centre, self.outputs.scale)
        )
        return forward(layers, inputs, act) * scale + centre

    def arrays(
        self, layers: "Layers", start: Sequence[tuple[np.ndarray, np.ndarray]]
    ) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """Layers as arrays: with the weights of dead inputs, and the scale of the outputs."""
        arrays = [(w.detach().numpy().copy(), b.detach().numpy().copy()) for w, b in layers]
        first = start[0][0].astype(arrays[0][0].dtype)
        first[self.live] = arrays[0][0]
        arrays[0] = first, arrays[0][1]
        weights, biases = arrays[-1]
        scale, centre = self.outputs.scale, self.outputs.centre
        arrays[-1] = (
            (weights * scale).astype(weights.dtype),
            (biases * scale + centre).astype(biases.dtype),
        )
        return tuple(arrays)


def _outputs(training: Dataset, recipe: Recipe) -> Scaling:
    match recipe.outputs:
        case "raw":
            columns = training.targets.shape[1]
            return Scaling(np.zeros(columns), np.ones(columns))
        case "scaled":
            return scaling(training.targets)


def _require_torch() -> None:
    if find_spec("torch") is None:
        raise ValueError(
            "torch is not installed and training needs it; run 'make torch' or 'pip install torch'"
        )


def _descend(
    layers: "Layers",
    stream: Iterator["Pairs"],
    validation: "Pairs",
    task: _Task,
    recipe: Recipe,
    on_epoch: Callable[[int, float], None],
) -> np.ndarray:
    """Step `layers` in place; return the losses of both sets before the steps checked."""
    import torch

    parameters = [tensor for layer in layers for tensor in layer]
    adam = torch.optim.Adam(parameters, lr=recipe.learning_rate, fused=True)
    history: list[tuple[float, float]] = []

    def loss(pairs: "Pairs") -> "Tensor":
        return task.loss(task.predict(layers, pairs[0]), pairs[1])

    for epoch in range(recipe.epochs):
        adam.param_groups[0]["lr"] = recipe.rate(epoch)
        adam.zero_grad()
        training = loss(next(stream))
        training.backward()
        value = training.item()
        if epoch % recipe.check == 0:
            with torch.no_grad():
                history.append((value, loss(validation).item()))
        if not np.isfinite(value):
            raise ValueError(
                f"training loss became {value} mm in epoch {epoch + 1} at a learning "
                f"rate of {recipe.learning_rate:g}; use a smaller one such as 0.001"
            )
        adam.step()
        on_epoch(epoch + 1, value)
    return np.array(history)


def _finish(layers: "Layers", training: Dataset, task: _Task, most: int) -> "Layers":
    """Go on in double precision, by L-BFGS on the mean square of scaled errors."""
    import torch

    layers = [
        (w.detach().double().requires_grad_(), b.detach().double().requires_grad_())
        for w, b in layers
    ]
    inputs, targets = task.tensors(training, "float64")
    unit = torch.tensor(task.outputs.scale)
    lbfgs = torch.optim.LBFGS(
        [tensor for layer in layers for tensor in layer],
        max_iter=most,
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


def _tensors(layers: Sequence[tuple[np.ndarray, np.ndarray]], live: np.ndarray) -> "Layers":
    import torch

    (weights, biases), *rest = layers
    return [
        (torch.tensor(w, requires_grad=True), torch.tensor(b, requires_grad=True))
        for w, b in [(weights[live], biases), *rest]
    ]


@contextmanager
def _one_thread() -> Iterator[None]:
    """Let torch work on one thread inside, and as before after."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)

"""Training: Adam on the mean distance between true and predicted places (torch lives here)."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from models.dataset import Dataset
from models.net import Activation, Net, NetOptions, Scaling, forward, initial, scaling

if TYPE_CHECKING:
    from torch import Tensor

    Layers = list[tuple[Tensor, Tensor]]
    Pairs = tuple[Tensor, Tensor]

__all__ = ["Recipe", "Trained", "train"]


@dataclass(frozen=True)
class Recipe:
    """How long and how fast to descend.

    Attributes
    ----------
    epochs
        Steps of Adam, each over the whole training set.
    learning_rate
        Of Adam, kept constant; the default is that of the library which the paper used.

    Raises
    ------
    ValueError
        When either is not positive.
    """

    epochs: int = 30000
    learning_rate: float = 1e-3

    def __post_init__(self) -> None:
        if self.epochs < 1:
            raise ValueError(f"epochs must be at least 1, got {self.epochs}; use 30000")
        if not self.learning_rate > 0.0:
            raise ValueError(
                f"learning rate must be positive, got {self.learning_rate:g}; use 0.001"
            )


@dataclass(frozen=True)
class Trained:
    """What training ends in.

    Attributes
    ----------
    net
        After the last epoch.
    history
        (epochs, 2) float64, mm: training and validation loss before each step (figure 2D).
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
) -> Trained:
    """Train a net on `training`, section 2.1 and equation 1 of the paper.

    Runs on one thread, where the same generator gives the same net to the last bit: the matrices
    are too small for more.

    Parameters
    ----------
    training, validation
        Unit touches; only the first is learnt from.
    options
        Architecture.
    recipe
        Epochs and learning rate.
    rng
        Source of the initial weights.
    on_epoch
        Called with the number of epochs done and the training loss, mm.

    Raises
    ------
    ValueError
        When the loss stops being finite, or torch is not installed.
    """
    _require_torch()
    scale = scaling(training.strain)
    start = initial((training.strain.shape[1], *options.layers, training.xy.shape[1]), rng)
    with _one_thread():
        layers, history = _descend(
            _tensors(start),
            (_pairs(training, scale), _pairs(validation, scale)),
            options.activation,
            recipe,
            on_epoch or (lambda epoch, loss: None),
        )
    arrays = tuple((w.detach().numpy().copy(), b.detach().numpy().copy()) for w, b in layers)
    return Trained(Net(options, scale, arrays), history)


def _require_torch() -> None:
    if find_spec("torch") is None:
        raise ValueError(
            "torch is not installed and training needs it; run 'make torch' or 'pip install torch'"
        )


def _descend(
    layers: "Layers",
    sets: tuple["Pairs", "Pairs"],
    activation: Activation,
    recipe: Recipe,
    on_epoch: Callable[[int, float], None],
) -> tuple["Layers", np.ndarray]:
    """Step `layers` in place; return them and the losses of both sets before each step."""
    import torch

    act = getattr(torch.nn.functional, activation)
    parameters = [tensor for layer in layers for tensor in layer]
    adam = torch.optim.Adam(parameters, lr=recipe.learning_rate, fused=True)
    history = np.empty((recipe.epochs, 2))

    def loss(pairs: "Pairs") -> "Tensor":
        inputs, places = pairs
        return torch.linalg.vector_norm(forward(layers, inputs, act) - places, dim=1).mean()

    for epoch in range(recipe.epochs):
        adam.zero_grad()
        training = loss(sets[0])
        training.backward()
        with torch.no_grad():
            history[epoch] = training.item(), loss(sets[1]).item()
        if not np.isfinite(history[epoch, 0]):
            raise ValueError(
                f"training loss became {history[epoch, 0]} mm in epoch {epoch + 1} at a learning "
                f"rate of {recipe.learning_rate:g}; use a smaller one such as 0.001"
            )
        adam.step()
        on_epoch(epoch + 1, float(history[epoch, 0]))
    return layers, history


def _tensors(layers: Sequence[tuple[np.ndarray, np.ndarray]]) -> "Layers":
    import torch

    return [
        (torch.tensor(w, requires_grad=True), torch.tensor(b, requires_grad=True))
        for w, b in layers
    ]


def _pairs(data: Dataset, scale: Scaling) -> "Pairs":
    """Scaled inputs and places of `data` as float32 tensors."""
    import torch

    inputs = (data.strain - scale.centre) / scale.scale
    return torch.tensor(inputs, dtype=torch.float32), torch.tensor(data.xy, dtype=torch.float32)


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

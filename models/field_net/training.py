"""Training of the field net: batches are drawn as they are needed, and a stopped run goes on."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np

from models.arrays import F32, F64
from models.field_net.inputs import LOGARITHM
from models.field_net.plates import draw_plates
from models.field_net.samples import Batch, stream
from models.field_net.store import FieldNet
from models.field_net.unet import INPUTS, Weights, first_weights, run, shapes
from models.nets.checkpoint import Checkpoint, fingerprint

if TYPE_CHECKING:
    from torch import Tensor

_BETA = (0.9, 0.99)
_LOOKED_AT = 100  # steps whose inputs say what the net has seen
_AVERAGE = 0.99  # of the weights over steps, which are those that are kept


@dataclass(frozen=True)
class FieldNetRecipe:
    """How a field net is trained.

    Attributes
    ----------
    steps : int
    seed : int
        Of weights, plates and fields.
    pairs : int
        Fields of two components a step.
    side : int
        Tiles along each side of a field, a multiple of 4.
    learning_rate : float
        At first; it falls to nothing as a cosine over `horizon` steps.
    horizon : int
    plates : int
        Plates under touches that are solved.
    """

    steps: int = 1000
    seed: int = 17
    pairs: int = 4
    side: int = 64
    learning_rate: float = 3e-3
    horizon: int = 3000
    plates: int = 120


@dataclass(frozen=True, eq=False)
class TrainedFieldNet:
    """Weights, and how they came about.

    Attributes
    ----------
    weights : dict of float32 arrays
    low, high : (9, 1, 1) float32
        Least and largest of each input in a part of what it was trained on.
    recipe : FieldNetRecipe
    seconds : float
        CPU time of the training.
    history : (S,) float64
        Loss of each step.
    """

    weights: Weights
    low: F32
    high: F32
    recipe: FieldNetRecipe
    seconds: float
    history: F64

    @property
    def net(self) -> FieldNet:
        """The net, with what names its training."""
        about = asdict(self.recipe) | {"cpu_seconds": round(self.seconds, 1)}
        return FieldNet(self.weights, self.low, self.high, about)


def train_field_net(
    recipe: FieldNetRecipe,
    checkpoint: Checkpoint | None = None,
    on_step: Callable[[int, float], None] | None = None,
    clock: Callable[[], float] = lambda: 0.0,
) -> TrainedFieldNet:
    """Train on drawn fields, on a GPU where there is one.

    Parameters
    ----------
    checkpoint : Checkpoint, optional
        A run with the same recipe goes on from it.
    on_step : callable, optional
        Is given the number of the step and its loss.
    clock : callable
        CPU time, s, for the record.
    """
    import torch

    rng = np.random.default_rng(recipe.seed)
    plates = draw_plates(recipe.plates, 2 * recipe.side, rng)
    device = "cuda" if torch.cuda.is_available() else "cpu"
    state = _State(first_weights(rng), recipe, device, clock)
    task = fingerprint(recipe, *(shape for shape in shapes().items()))
    if checkpoint is not None:
        state.load(checkpoint.load(task))
    while state.step < recipe.steps:
        found = state.descend(_batch(recipe, plates, state.step))
        if on_step is not None:
            on_step(state.step, found)
        if checkpoint is not None and state.step % checkpoint.every == 0:
            checkpoint.save(state.arrays() | {"task": np.array(task)})
    low, high = _range(recipe, plates)
    return TrainedFieldNet(
        state.average(), low, high, recipe, state.seconds, np.array(state.history)
    )


def _range(recipe: FieldNetRecipe, plates: list[F64]) -> tuple[F32, F32]:
    """Least and largest of each input over the first steps."""
    low, high = (np.full((INPUTS, 1, 1), far, np.float32) for far in (np.inf, -np.inf))
    for step in range(min(_LOOKED_AT, recipe.steps)):
        inputs = _batch(recipe, plates, step).inputs
        low = np.minimum(low, inputs.min(axis=(0, 2, 3))[:, None, None])
        high = np.maximum(high, inputs.max(axis=(0, 2, 3))[:, None, None])
    return low, high


def _batch(recipe: FieldNetRecipe, plates: list[F64], step: int) -> Batch:
    """Draw the fields of one step: its own, so that a run that goes on draws what it would have."""
    draws = np.random.default_rng((recipe.seed, step))
    return next(stream((recipe.side, recipe.side), recipe.pairs, plates, draws))


class _State:
    """Weights, what Adam remembers of them, their mean, and the losses so far."""

    def __init__(
        self, weights: Weights, recipe: FieldNetRecipe, device: str, clock: Callable[[], float]
    ) -> None:
        import torch

        self._clock = clock
        self.recipe, self.device, self.step, self.seconds = recipe, device, 0, 0.0
        self.history: list[float] = []
        self.weights = {
            name: torch.tensor(array, device=device, requires_grad=True)
            for name, array in weights.items()
        }
        self.mean = {name: value.detach().clone() for name, value in self.weights.items()}
        self.first = {name: torch.zeros_like(value) for name, value in self.mean.items()}
        self.second = {name: torch.zeros_like(value) for name, value in self.mean.items()}

    def descend(self, batch: Batch) -> float:
        """Take one step of Adam (Kingma and Ba 2015)."""
        import torch

        began = self._clock()
        found = _loss(self.weights, batch, self.device)
        found.backward()
        self.step += 1
        rate = self.recipe.learning_rate * _fall(self.step / self.recipe.horizon)
        low, high = (1 - beta**self.step for beta in _BETA)
        with torch.no_grad():
            for name, value in self.weights.items():
                slope = value.grad
                if slope is None:
                    continue
                slope = slope.clamp(-1.0, 1.0)
                self.first[name].lerp_(slope, 1 - _BETA[0])
                self.second[name].lerp_(slope * slope, 1 - _BETA[1])
                value -= (
                    rate * (self.first[name] / low) / ((self.second[name] / high).sqrt() + 1e-8)
                )
                self.mean[name].lerp_(value, 1 - min(_AVERAGE, self.step / (self.step + 10)))
                value.grad = None
        self.history.append(float(found.detach()))
        self.seconds += self._clock() - began
        return self.history[-1]

    def average(self) -> Weights:
        return {name: np.array(value.cpu().numpy()) for name, value in self.mean.items()}

    def arrays(self) -> dict[str, F32 | F64]:
        """Everything from which a run goes on."""
        kept: dict[str, F32 | F64] = {
            "progress": np.array([self.step, self.seconds]),
            "history": np.array(self.history),
        }
        for group in ("weights", "mean", "first", "second"):
            for name, value in getattr(self, group).items():
                kept[f"{group}:{name}"] = np.array(value.detach().cpu().numpy())
        return kept

    def load(self, kept: dict[str, np.ndarray] | None) -> None:
        """Go on from what `arrays` kept, if there is anything."""
        import torch

        if kept is None:
            return
        self.step, self.seconds = int(kept["progress"][0]), float(kept["progress"][1])
        self.history = [float(value) for value in kept["history"]]
        with torch.no_grad():
            for group in ("weights", "mean", "first", "second"):
                for name, value in getattr(self, group).items():
                    value.copy_(torch.tensor(kept[f"{group}:{name}"]))


def _fall(progress: float) -> float:
    """Fraction of the learning rate: it rises over the first fiftieth, then falls as a cosine."""
    progress = min(progress, 1.0)
    return min(1.0, 50 * progress) * 0.5 * (1 + float(np.cos(np.pi * progress)))


def _loss(weights: dict[str, Tensor], batch: Batch, device: str) -> Tensor:
    """Negative log likelihood of the truth, normal about the corrected field, a value."""
    import torch

    inputs, error, counted = (
        torch.tensor(array, device=device) for array in (batch.inputs, batch.error, batch.counted)
    )
    out = run(weights, inputs)[:, :, : error.shape[2], : error.shape[3]]
    growth = out[:, 3:].clamp(-LOGARITHM, LOGARITHM)
    each = 0.5 * (error - out[:, :3]).square() * torch.exp(-2 * growth) + growth
    return (each * counted).sum() / (3 * counted.sum()).clamp(min=1.0)

"""Training of the field net: batches are drawn as they are needed, and a stopped run goes on."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np

from models.arrays import F32, F64
from models.field_net.inputs import LOGARITHM
from models.field_net.plates import draw_plates
from models.field_net.random_speckle import draw_speckle
from models.field_net.rendered import rendered_batch
from models.field_net.samples import Batch, stream
from models.field_net.store import FieldNet
from models.field_net.unet import INPUTS, Weights, first_weights, run, shapes
from models.nets.checkpoint import Checkpoint, fingerprint
from models.nets.descent import Descent, fall, finish
from models.nets.grid_net import input_range

if TYPE_CHECKING:
    from torch import Tensor

_ROOM = 48  # px by which a pattern is larger than an image
_LOOKED_AT = 100  # steps whose inputs say what the net has seen
_KEEP = 0.99  # of the running mean of the weights, which are those that are kept


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
    rendered : int
        Steps that follow on rendered images and drawn fields alike; the learning rate falls as a
        cosine over them.
    rendered_side : int, px
        Of the images.
    rendered_rate : float
        Learning rate of these steps at first.
    patterns : int
        Speckle patterns that are drawn.
    """

    steps: int = 1000
    seed: int = 17
    pairs: int = 4
    side: int = 96
    learning_rate: float = 3e-3
    horizon: int = 3000
    plates: int = 120
    rendered: int = 0
    rendered_side: int = 320
    rendered_rate: float = 1e-3
    patterns: int = 48


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
        Loss of each step, those with rendered images last.
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
    """Train on drawn fields and then on rendered images too, on a GPU where there is one.

    Parameters
    ----------
    checkpoint : Checkpoint, optional
        A run with the same recipe goes on from it.
    on_step : callable, optional
        Is given the number of the step and its loss.
    clock : callable
        CPU time, s, for the record.
    """
    began = clock()
    rng = np.random.default_rng(recipe.seed)
    plates = draw_plates(recipe.plates, 2 * recipe.side, rng)
    state = Descent(first_weights(rng), _KEEP)
    stock = _Stock(recipe, plates, rng, state.device)

    def take() -> float:
        batches = stock.batches(state.step)
        return state.descend(
            lambda weights, device: _mean_loss(weights, batches, device), _rate(recipe, state.step)
        )

    task = fingerprint(recipe, *shapes().items())
    steps = recipe.steps + recipe.rendered
    finish(state, steps, take, task, checkpoint, on_step, lambda: clock() - began)
    low, high = input_range(INPUTS, stock.looked_at())
    return TrainedFieldNet(
        state.average(), low, high, recipe, state.seconds, np.array(state.history)
    )


def _rate(recipe: FieldNetRecipe, step: int) -> float:
    """Learning rate of a step."""
    if step < recipe.steps:
        return recipe.learning_rate * fall((step + 1) / recipe.horizon)
    return recipe.rendered_rate * fall((step - recipe.steps) / recipe.rendered)


class _Stock:
    """Plates and patterns, of which the batches of all steps are drawn.

    A step draws by a seed of its own, so that a run that goes on draws what it would have.
    """

    def __init__(
        self, recipe: FieldNetRecipe, plates: list[F64], rng: np.random.Generator, device: str
    ):
        side, count = recipe.rendered_side + _ROOM, recipe.patterns if recipe.rendered else 0
        self._recipe, self._plates = recipe, plates
        self._patterns = draw_speckle(count, side, rng, device)

    def batches(self, step: int) -> list[Batch]:
        """Draw the fields of one step, and render the images that it may have beside them."""
        recipe, draws = self._recipe, np.random.default_rng((self._recipe.seed, step))
        shape = (recipe.side, recipe.side)
        drawn = next(stream(shape, recipe.pairs, self._plates, draws))
        if step < recipe.steps:
            return [drawn]
        side = recipe.rendered_side
        return [drawn, rendered_batch(self._patterns, self._plates, recipe.pairs, side, draws)]

    def looked_at(self) -> Iterator[F32]:
        """Draw the inputs of the first steps of each kind."""
        recipe = self._recipe
        for first, count in ((0, recipe.steps), (recipe.steps, recipe.rendered)):
            for step in range(min(_LOOKED_AT, count)):
                yield from (batch.inputs for batch in self.batches(first + step))


def _mean_loss(weights: dict[str, Tensor], batches: list[Batch], device: str) -> Tensor:
    import torch

    return torch.stack([_loss(weights, batch, device) for batch in batches]).mean()


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

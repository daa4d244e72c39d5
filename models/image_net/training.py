"""Training of the image net: pairs are rendered as they are needed, and a stopped run goes on."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np

from dic import adaptive_field, prepare
from models.arrays import F32, F64
from models.field_net.plates import draw_plates
from models.field_net.random_speckle import SPACING, draw_speckle
from models.field_net.rendered_pairs import RenderedPair, draw_pairs
from models.image_net.features import INPUTS, pair_features
from models.image_net.loader import loader
from models.image_net.network import first_weights, mixed, run, shapes
from models.image_net.store import ImageNet
from models.image_net.warped_pair import (
    ImagePair,
    PairMotion,
    first_motion,
    image_pair,
    on_cells,
    on_pixels,
)
from models.nets.checkpoint import Checkpoint, fingerprint
from models.nets.descent import Descent, fall, finish
from models.nets.grid_net import input_range
from synthetic import BatchWarper

if TYPE_CHECKING:
    from torch import Tensor

_PASSES = 2  # of which the second starts from what the net has found
_SUBSETS = (11, 15, 21, 31)  # px, of the fields from which it starts
_STEP = 5  # px
_FAR = 1.5  # px, of a start beyond which nothing is learned
_RIM = 4  # cells, of which none is learned
_LOOKED_AT = 100  # groups whose inputs say what the net has seen
_TAIL = 1.77  # so that σ is the standard deviation where errors are normal
_HARD = 0.5  # power of σ that weighs a cell: 0 is the likelihood, 1 the error itself
_ROOM = 128  # px more than a pair, of a pattern
_FIRST = 0.01  # of the learning rate, at the first step


@dataclass(frozen=True)
class ImageNetRecipe:
    """How an image net is trained.

    Attributes
    ----------
    steps : int
    seed : int
        Of weights, patterns, plates and fields.
    pairs : int
        Pairs of images that are rendered a step; each is taken four times.
    side : int
        Pixels along each side of an image, a multiple of 16.
    learning_rate : float
        At first; it falls to nothing as a cosine over `horizon` steps.
    horizon : int
    patterns : int
    plates : int
        Plates under touches that are solved.
    """

    steps: int = 2900
    seed: int = 17
    pairs: int = 1
    side: int = 160
    learning_rate: float = 2e-3
    horizon: int = 4200
    patterns: int = 72
    plates: int = 60


@dataclass(frozen=True, eq=False)
class TrainedImageNet:
    """Weights, and how they came about.

    Attributes
    ----------
    net : ImageNet
    history : (S,) float64
        Loss of each step.
    seconds : float
        CPU time of the training.
    """

    net: ImageNet
    history: F64
    seconds: float


@dataclass(frozen=True, eq=False)
class _Stock:
    """Patterns and plates, of which all pairs are drawn."""

    patterns: list[BatchWarper]
    plates: list[F64]


def train_image_net(
    recipe: ImageNetRecipe,
    checkpoint: Checkpoint | None = None,
    on_step: Callable[[int, float], None] | None = None,
    clock: Callable[[], float] = lambda: 0.0,
) -> TrainedImageNet:
    """Train on rendered pairs, on a GPU where there is one.

    Parameters
    ----------
    recipe : ImageNetRecipe
    checkpoint : Checkpoint, optional
        A run with the same recipe goes on from it.
    on_step : callable, optional
        Is given the number of the step and its loss.
    clock : callable
        CPU time, s, for the record.
    """
    began = clock()
    rng = np.random.default_rng(recipe.seed)
    state = Descent(first_weights(rng))
    plates = draw_plates(recipe.plates, recipe.side // SPACING + 8, rng)
    stock = _Stock(draw_speckle(recipe.patterns, recipe.side + _ROOM, rng, state.device), plates)
    with loader(lambda number: _pairs(recipe, stock, number)) as load:

        def take() -> float:
            pairs = [pair for group in load.batch(state.step) for pair in group]
            rate = recipe.learning_rate * fall(state.step / recipe.horizon, _FIRST)
            return state.descend(lambda weights, device: _loss(weights, pairs, device), rate)

        task = fingerprint(recipe, *shapes().items())
        finish(state, recipe.steps, take, task, checkpoint, on_step, lambda: clock() - began)
    low, high = input_range(INPUTS, _looked_at(recipe, stock))
    about = asdict(recipe) | {"cpu_seconds": round(state.seconds, 1)}
    net = ImageNet(state.average(), low, high, about)
    return TrainedImageNet(net, np.array(state.history), state.seconds)


@dataclass(frozen=True, eq=False)
class _Started:
    """A pair, the motion from which the net starts, and the truth."""

    pair: ImagePair
    motion: PairMotion
    truth: F32


def _pairs(recipe: ImageNetRecipe, stock: _Stock, number: int) -> list[_Started]:
    """Render a group of pairs by a seed of its own, and measure where the net starts."""
    rng = np.random.default_rng((recipe.seed, number))
    drawn = draw_pairs(stock.patterns, stock.plates, recipe.pairs, recipe.side, rng)
    started = (_started(pair, int(rng.choice(_SUBSETS))) for pair in drawn)
    return [pair for pair in started if pair is not None]


def _started(pair: RenderedPair, subset: int) -> _Started | None:
    ref = prepare(pair.first, subset, _STEP, roi=pair.roi)
    found = adaptive_field(ref, pair.second)
    if not found.valid.any():
        return None
    motion = first_motion(found, pair.first.shape)
    return _Started(image_pair(ref, pair.second), motion, pair.truth)


def _looked_at(recipe: ImageNetRecipe, stock: _Stock) -> Iterator[F32]:
    """Draw the inputs of the first steps."""
    for number in range(min(_LOOKED_AT, recipe.steps)):
        for pair in _pairs(recipe, stock, number):
            yield pair_features(pair.pair, pair.motion).inputs


def _loss(weights: dict[str, Tensor], pairs: Sequence[_Started], device: str) -> Tensor:
    """Loss of the passes: each goes on from what the one before has found."""
    import torch

    motions, total = [pair.motion for pair in pairs], torch.zeros((), device=device)
    for _ in range(_PASSES):
        seen = [
            pair_features(pair.pair, motion) for pair, motion in zip(pairs, motions, strict=True)
        ]
        at = np.stack([motion.cells for motion in motions])
        left = np.stack([pair.truth for pair in pairs]) - at
        sigma = np.stack([motion.sigma for motion in motions])
        noise = np.stack([each.noise for each in seen])[:, None]
        inputs, windows, size, off, before, counted = (
            torch.tensor(array, device=device)
            for array in (
                np.stack([each.inputs for each in seen]),
                np.stack([each.windows for each in seen]),
                np.stack([each.size for each in seen]),
                left / noise,
                np.log(sigma / noise),
                _counted(left, pairs),
            )
        )
        moved, growth = mixed(run(weights, inputs), windows, size)
        unit = torch.tensor(noise, device=device)
        total = total + _likelihood(off - moved / unit, growth + before, counted)
        motions = _moved(at, moved, sigma, growth, pairs)
    return total / _PASSES


def _moved(
    at: F32, moved: Tensor, sigma: F32, growth: Tensor, pairs: Sequence[_Started]
) -> list[PairMotion]:
    """Motions from which the next pass starts."""
    cells = at + moved.detach().cpu().numpy()
    spread = sigma * np.exp(growth.detach().cpu().numpy())
    return [
        PairMotion(on_pixels(cells[k], pair.pair.first.shape), spread[k])
        for k, pair in enumerate(pairs)
    ]


def _counted(left: F32, pairs: Sequence[_Started]) -> F32:
    """Cells to which a start lies near enough, in the ROI and off the border: (B, 1, R, C)."""
    near = (np.abs(left).max(axis=1, keepdims=True) < _FAR).astype(np.float32)
    near[..., :_RIM, :] = near[..., -_RIM:, :] = 0
    near[..., :_RIM] = near[..., -_RIM:] = 0
    return near * np.stack([on_cells(pair.pair.weight) > 0.5 for pair in pairs])[:, None]


def _likelihood(off: Tensor, logarithm: Tensor, counted: Tensor) -> Tensor:
    """Likelihood, -ln, of a distribution that is normal with the tails of Laplace's.

    It is weighted by a power of σ, so that hard cells count (Seitzer et al., ICLR 2022).
    """
    import torch

    scaled = off.square() * torch.exp(-2 * logarithm)
    each = _TAIL * (torch.sqrt(1 + scaled) - 1) + logarithm
    each = each * torch.exp(_HARD * logarithm.detach())
    return (each * counted).sum() / (2 * counted.sum()).clamp(min=1.0)

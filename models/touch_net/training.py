"""Training of the touch net: touches are drawn as they are needed, and a stopped run goes on."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from models.arrays import F32, F64, I64
from models.nets.checkpoint import Checkpoint, fingerprint
from models.nets.descent import Descent, fall, finish
from models.touch_net.benches import DescribedBench, bench_forward, draw_bench
from models.touch_net.heads import draw_fits, head_loss
from models.touch_net.network import PROPOSE, first_weights, run_torch, shapes
from models.touch_net.prior import MAX_TOUCHES, TouchRange
from models.touch_net.proposals import proposal_loss
from models.touch_net.store import TouchNet
from models.touch_net.touch_net import KnownForward, know, signature

if TYPE_CHECKING:
    from torch import Tensor

_FIRST = 0.01  # of the learning rate, at the first step
_OFTEN = np.array([0.04, 0.12, 0.2, 0.28, 0.36])
"""How often none, one, … touches are drawn for proposals: the more, the harder to propose."""


@dataclass(frozen=True)
class TouchNetRecipe:
    """How a touch net is trained.

    Attributes
    ----------
    steps : int
        Of the net that proposes.
    head_steps : int
        Of the net that looks at how proposals fit, after those.
    seed : int
        Of weights, benches and touches.
    batch, head_batch : int
        Measurements a step.
    learning_rate : float
        At first; it falls to nothing as a cosine.
    benches : int
        Benches that are drawn, beside the one described.
    """

    steps: int = 60000
    head_steps: int = 5000
    seed: int = 17
    batch: int = 512
    head_batch: int = 128
    learning_rate: float = 2e-3
    benches: int = 11


@dataclass(frozen=True, eq=False)
class TrainedTouchNet:
    """A net, and how it came about.

    Attributes
    ----------
    net : TouchNet
    history : (S,) float64
        Loss of each step: first of the proposals, then of what looks at them.
    seconds : float
        CPU time of the training.
    """

    net: TouchNet
    history: F64
    seconds: float


def train_touch_net(
    described: DescribedBench,
    touches: TouchRange,
    recipe: TouchNetRecipe,
    checkpoint: Checkpoint | None = None,
    on_step: Callable[[int, float], None] | None = None,
    clock: Callable[[], float] = lambda: 0.0,
) -> TrainedTouchNet:
    """Train on drawn touches on drawn benches, on a GPU where there is one.

    Parameters
    ----------
    described : DescribedBench
    touches : TouchRange
    recipe : TouchNetRecipe
    checkpoint : Checkpoint, optional
        A run with the same bench, touches and recipe goes on from it.
    on_step : callable, optional
        Is given the number of the step and its loss.
    clock : callable
        CPU time, s, for the record.
    """
    began = clock()
    rng = np.random.default_rng(recipe.seed)
    benches = _benches(described, touches, recipe, rng)
    state = Descent(first_weights(rng))
    task = fingerprint(described, touches, recipe, *shapes().items())
    finish(
        state,
        recipe.steps + recipe.head_steps,
        lambda: _step(state, benches, touches, recipe),
        task,
        checkpoint,
        on_step,
        lambda: clock() - began,
    )
    seen = np.array([signature(each.forward, touches) for each in benches])
    about: dict[str, object] = {"bench": _plain(described), "recipe": asdict(recipe)}
    about["cpu_seconds"] = round(state.seconds, 1)
    net = TouchNet(state.average(), touches, seen.min(axis=0), seen.max(axis=0), about)
    return TrainedTouchNet(net, np.array(state.history), state.seconds)


def _plain(described: DescribedBench) -> dict[str, object]:
    """State what names a bench, as plain values."""
    plate = described.plate
    return {
        "size": list(plate.size),
        "thickness": plate.thickness,
        "young": plate.young,
        "poisson": plate.poisson,
        "edges": str(plate.edges),
        "stand_off": described.stand_off,
        "pixels": list(described.pixels),
        "tile": described.tile,
        "noise": described.noise,
    }


def _benches(
    described: DescribedBench,
    touches: TouchRange,
    recipe: TouchNetRecipe,
    rng: np.random.Generator,
) -> list[KnownForward]:
    """Prepare the bench that is described, and those that are drawn about it."""
    drawn = [bench_forward(described)]
    drawn += [draw_bench(described, rng) for _ in range(recipe.benches)]
    return [know(forward, touches) for forward in drawn]


def _step(
    state: Descent, benches: list[KnownForward], touches: TouchRange, recipe: TouchNetRecipe
) -> float:
    """Take one step, on measurements of its own: a run that goes on draws what it would have."""
    rng = np.random.default_rng((recipe.seed, state.step))
    bench = benches[rng.integers(len(benches))]
    if state.step < recipe.steps:
        batch = draw_batch(bench, touches, recipe.batch, rng)
        return state.descend(
            lambda weights, device: _proposal_loss(weights, batch, touches, device),
            recipe.learning_rate * fall(state.step / recipe.steps, _FIRST),
        )
    if state.step == recipe.steps:
        state.settle()
    fits = draw_fits(state.average(), bench, touches, recipe.head_batch, rng)
    return state.descend(
        lambda weights, device: head_loss(weights, fits, device),
        recipe.learning_rate * fall((state.step - recipe.steps) / recipe.head_steps, _FIRST),
    )


class TouchBatch(NamedTuple):
    """Measurements of touches.

    Attributes
    ----------
    inputs : (N, 513) float32
    truth : (N, 4, 3) float64
        The first `number` of each row.
    number : (N,) int
    """

    inputs: F32
    truth: F64
    number: I64


def draw_batch(
    bench: KnownForward, touches: TouchRange, size: int, rng: np.random.Generator
) -> TouchBatch:
    """Draw touches and what a bench measures of them."""
    number = rng.choice(MAX_TOUCHES + 1, size, p=_OFTEN)
    truth = touches.draw(rng, size * MAX_TOUCHES).reshape(size, MAX_TOUCHES, 3)
    there = np.arange(MAX_TOUCHES) < number[:, None]
    row, pressed = np.nonzero(there)[0], truth[there]
    response = bench.forward.response(pressed[:, :2])
    measured = rng.standard_normal((size, response.shape[1]))
    np.add.at(measured, row, pressed[:, 2:] * response)
    return TouchBatch(bench.maps.read(measured), truth, number)


def _proposal_loss(
    weights: dict[str, Tensor], batch: TouchBatch, touches: TouchRange, device: str
) -> Tensor:
    import torch

    inputs = torch.tensor(batch.inputs, device=device)
    truth = torch.tensor(touches.scaled(batch.truth), dtype=torch.float32, device=device)
    out = run_torch(weights, PROPOSE, "propose", inputs)
    return proposal_loss(out, truth, torch.tensor(batch.number, device=device))

"""Training: a net from a data set by a recipe (torch lives here and in `models.nets.optimise`)."""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib.util import find_spec
from itertools import chain, pairwise, repeat
from typing import TYPE_CHECKING, Literal

import numpy as np

from models.data.dataset import Dataset
from models.nets.checkpoint import Checkpoint, fingerprint
from models.nets.loss import distance_loss
from models.nets.net import Net, NetOptions, Scaling, initial, scaling
from models.nets.optimise import Descent, TrainingTask, run_adam, run_lbfgs
from models.nets.recipe import Recipe
from models.nets.set_encoding import encode, permutation_invariant_loss

if TYPE_CHECKING:
    from torch import Tensor

    from models.nets.loss import Loss

    Layers = list[tuple[Tensor, Tensor]]
    Pairs = tuple[Tensor, Tensor]

_LARGE = 2e7
"""Products of numbers in a step, from which a GPU takes it in less time than one core."""


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


def train_net(
    training: Dataset,
    validation: Dataset,
    options: NetOptions,
    recipe: Recipe,
    rng: np.random.Generator,
    on_epoch: Callable[[int, float], None] | None = None,
    loss: "Loss | None" = None,
    batches: Iterator[Dataset] | None = None,
    checkpoint: Checkpoint | None = None,
) -> Trained:
    """Train a net on `training`, section 2 of the paper.

    Runs on one thread, where the same generator gives the same net to the last bit, also where it
    was killed on the way and went on from its checkpoint; or, where a step is large and there is a
    GPU, on that, where sums may round in another order.

    Parameters
    ----------
    training, validation
        Only the first is learnt from; it also says how inputs and outputs are scaled.
    options
        Architecture.
    recipe
        Epochs, learning rate, steps of L-BFGS.
    rng
        Source of the initial weights.
    on_epoch
        Called with the number of epochs done and the training loss.
    loss
        Of what the layers report and the targets; by default equation 1, the distance of one touch,
        or that of touches without an order where `options` has poles.
    batches
        What each epoch learns from, an endless iterator; all of `training` where there is none.
    checkpoint
        Where to keep what was reached; a file there that belongs to the same training is gone on
        from, and it is removed in the end.

    Raises
    ------
    ValueError
        When the loss stops being finite, or torch is not installed.
    """
    require_torch()
    scale = scaling(training.strain, options.inputs)
    encoded = _encoded(training, options)
    sizes = (training.strain.shape[1], *options.layers, encoded.targets.shape[1])
    start = initial(sizes, rng, recipe.start)
    live = training.strain.std(axis=0) > 0.0  # of reading B one input in three; the rest is 0
    fed = replace(scale, centre=scale.centre[live], scale=scale.scale[live])
    usual = permutation_invariant_loss(options.poles) if options.poles else distance_loss()
    first = training if batches is None else next(batches)
    task = TrainingTask(
        fed,
        live,
        output_scaling(encoded, recipe.outputs),
        options.activation,
        loss or usual,
        device_for(sizes, len(first)),
    )
    with one_thread():
        layers = to_tensors([(start[0][0][live], start[0][1]), *start[1:]], task.device)
        stream = repeat(task.tensors(first))
        if batches is not None:
            stream = map(task.tensors, chain([first], batches))
        report = on_epoch or _nobody
        name = fingerprint(training.strain, training.targets, options, recipe, start[0][0])
        descent = Descent(layers, recipe, checkpoint, name)
        history = run_adam(descent, stream, task.tensors(validation), task, report)
        if recipe.lbfgs_steps:
            layers = run_lbfgs(layers, encoded, task, recipe.lbfgs_steps)
    if checkpoint:
        checkpoint.clear()
    return Trained(Net(options, scale, task.arrays(layers)), history)


def _nobody(epoch: int, loss: float) -> None:
    """Take a report that nobody wants."""


def _encoded(training: Dataset, options: NetOptions) -> Dataset:
    """Return the samples with targets as the layers report them."""
    if not options.poles:
        return training
    return Dataset(training.strain, encode(training.targets, options.poles))


def output_scaling(training: Dataset, outputs: Literal["raw", "scaled"]) -> Scaling:
    """Return what a net's outputs are scaled by, see `Recipe`."""
    match outputs:
        case "raw":
            columns: int = training.targets.shape[1]
            return Scaling(np.zeros(columns), np.ones(columns))
        case "scaled":
            return scaling(training.targets)


def require_torch() -> None:
    """Refuse in one sentence where torch is not installed."""
    if find_spec("torch") is None:
        raise ValueError(
            "torch is not installed and training needs it; run 'make torch' or 'pip install torch'"
        )


def device_for(sizes: Sequence[int], samples: int) -> str:
    """Name where steps of a net are taken: on a GPU, where one is there and gains by it.

    Parameters
    ----------
    sizes
        Inputs, neurons of each layer, and outputs.
    samples
        Of a step.
    """
    import torch

    products = samples * sum(fed * gives for fed, gives in pairwise(sizes))
    return "cuda" if products > _LARGE and torch.cuda.is_available() else "cpu"


def to_tensors(layers: Sequence[tuple[np.ndarray, np.ndarray]], device: str = "cpu") -> "Layers":
    """Return layers as tensors that learn."""
    import torch

    def learning(array: np.ndarray) -> "Tensor":
        return torch.tensor(array, device=device, requires_grad=True)

    return [(learning(weights), learning(biases)) for weights, biases in layers]


@contextmanager
def one_thread() -> Generator[None, None, None]:
    """Let torch work on one thread inside, and as before after."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)

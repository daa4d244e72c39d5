"""The two other kinds of net that the paper tried: convolutional and adversarial (section 2.1).

The paper gives neither sizes nor figures for them, only that they did worse. Both are of about the
size of its 2 x 32 net and learn by the same loss, equation 1. Both end as a plain `Net`: a
convolution along a ring is a matrix with the same numbers in every turn of it.
"""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import repeat
from typing import TYPE_CHECKING

import numpy as np

from models.data.dataset import Dataset
from models.nets.checkpoint import Checkpoint, fingerprint
from models.nets.loss import Loss, distance_loss
from models.nets.net import Net, NetOptions, initial, scaling
from models.nets.optimise import Descent, TrainingTask, run_adam
from models.nets.recipe import Recipe
from models.nets.train import Trained, one_thread, output_scaling, require_torch, to_tensors

if TYPE_CHECKING:
    from torch import Tensor
    from torch.optim import Optimizer

    Layers = list[tuple[Tensor, Tensor]]

# Gauges that a kernel of each convolution covers, its channels, and how far it steps.
_FIRST, _SECOND, _CHANNELS, _STEP = 5, 5, 8, 2

# Neurons of the critic, and the weight of its verdict beside the distance, mm.
_CRITIC = 32
_VERDICT = 0.1


def train_convolutional(
    training: Dataset,
    validation: Dataset,
    recipe: Recipe,
    rng: np.random.Generator,
    on_epoch: Callable[[int, float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> Trained:
    """Train a net that slides two kernels of 5 gauges along the ring before a layer of 32.

    Parameters
    ----------
    training, validation
        Only the first is learnt from; the gauges in the order of the ring, as `gauge_layout` gives
        them; its ends meet.
    recipe
        Each step is over the whole training set; L-BFGS takes no part.
    rng
        Source of the first weights.
    on_epoch, checkpoint
        As for `train_net`.

    Raises
    ------
    ValueError
        When torch is not installed or the loss stops being finite.
    """
    require_torch()
    gauges, outputs = training.strain.shape[1] // 3, training.targets.shape[1]
    flat = _CHANNELS * -(-gauges // _STEP)
    kernels = initial((3 * _FIRST, _CHANNELS), rng), initial((_CHANNELS * _SECOND, _CHANNELS), rng)
    start = (*kernels[0], *kernels[1], *initial((flat, 32, outputs), rng))
    whole = np.ones(training.strain.shape[1], bool)
    inner = TrainingTask(
        scaling(training.strain),
        whole,
        output_scaling(training, recipe.outputs),
        "relu",
        distance_loss(),
    )
    task = _RingTask(inner, gauges)
    with one_thread():
        layers = to_tensors(start)
        name = fingerprint("convolutional", training.strain, training.targets, recipe, start[0][0])
        descent = Descent(layers, recipe, checkpoint, name)
        stream, watched = repeat(inner.tensors(training)), inner.tensors(validation)
        history = run_adam(descent, stream, watched, task, on_epoch or _nobody)
        dense = task.unrolled(layers)
    if checkpoint:
        checkpoint.clear()
    widths = tuple(len(biases) for _, biases in dense[:-1])
    return Trained(Net(NetOptions(widths), inner.scale, inner.arrays(dense)), history)


@dataclass(frozen=True)
class _RingTask:
    """A training whose first two layers are kernels (inputs, channels) that slide along the ring.

    Attributes
    ----------
    task
        Of the net that the kernels are a part of.
    gauges
        Along the ring, three numbers each.
    """

    task: TrainingTask
    gauges: int

    @property
    def loss(self) -> Loss:
        """Of the net."""
        return self.task.loss

    def predict(self, layers: "Layers", inputs: "Tensor") -> "Tensor":
        """Return targets in their units."""
        from torch.nn import functional

        first, second, *rest = layers
        along = inputs.reshape(len(inputs), self.gauges, 3).transpose(1, 2)
        for (weights, biases), width, step in ((first, _FIRST, 1), (second, _SECOND, _STEP)):
            kernel = weights.reshape(width, -1, len(biases)).permute(2, 1, 0)
            ends = functional.pad(along, (width // 2, width // 2), mode="circular")
            along = functional.relu(functional.conv1d(ends, kernel, biases, stride=step))
        return self.task.predict(rest, along.transpose(1, 2).flatten(1))

    def unrolled(self, layers: "Layers") -> "Layers":
        """Return the layers of the same net with the kernels written out as matrices."""
        import torch

        sizes = 3 * self.gauges, _CHANNELS * self.gauges
        dense: Layers = []
        for (weights, biases), rows, size in zip(layers, self._rows(), sizes, strict=False):
            turns = len(rows)
            matrix = torch.zeros(size, turns, len(biases), dtype=weights.dtype)
            columns = torch.arange(turns)[:, None].expand_as(rows)
            matrix = matrix.index_put((rows, columns), weights.detach().expand(turns, -1, -1))
            dense.append((matrix.reshape(size, -1), biases.detach().repeat(turns)))
        return [*dense, *layers[2:]]

    def _rows(self) -> "tuple[Tensor, Tensor]":
        """Which inputs each turn of both kernels covers, (turns, inputs of the kernel)."""
        return (
            _covered(self.gauges, 3, _FIRST, 1),
            _covered(self.gauges, _CHANNELS, _SECOND, _STEP),
        )


def _covered(gauges: int, channels: int, width: int, step: int) -> "Tensor":
    """Return the inputs under a kernel about every `step`-th gauge of a ring.

    Numbers run gauge by gauge, the channels of each together.
    """
    import torch

    middles = torch.arange(0, gauges, step)
    beside = (middles[:, None] + torch.arange(width) - width // 2) % gauges
    return (channels * beside[:, :, None] + torch.arange(channels)).reshape(len(middles), -1)


def train_adversarial(
    training: Dataset,
    validation: Dataset,
    recipe: Recipe,
    rng: np.random.Generator,
    on_epoch: Callable[[int, float], None] | None = None,
) -> Trained:
    """Train a 2 x 32 net against a critic that separates its places from true ones.

    A conditional adversarial pair (Mirza and Osindero 2014): the critic sees the strains too. The
    net takes the distance to the true place and the critic's verdict together as its loss. A run
    that was killed begins anew.

    Parameters
    ----------
    training, validation, recipe, rng, on_epoch
        As for `train_convolutional`; a step is one of the critic and one of the net.

    Raises
    ------
    ValueError
        When torch is not installed.
    """
    require_torch()
    import torch
    from torch import nn

    columns: int = training.strain.shape[1]
    outputs: int = training.targets.shape[1]
    task = TrainingTask(
        scaling(training.strain),
        np.ones(columns, bool),
        output_scaling(training, recipe.outputs),
        "relu",
        distance_loss(),
    )
    report, history = on_epoch or _nobody, list[tuple[float, float]]()
    with one_thread():
        layers = to_tensors(initial((columns, 32, 32, outputs), rng))
        critic = to_tensors(initial((columns + outputs, _CRITIC, 1), rng))
        (inputs, targets), watched = task.tensors(training), task.tensors(validation)
        adam = partial(torch.optim.Adam, lr=recipe.learning_rate, fused=True)
        teach = adam([tensor for layer in layers for tensor in layer])
        judge = adam([tensor for layer in critic for tensor in layer])
        softplus = nn.functional.softplus

        def verdict(places: "Tensor") -> "Tensor":
            (first, before), (last, after) = critic
            seen = torch.cat([inputs, places / 100.0], dim=1) @ first + before
            return nn.functional.leaky_relu(seen, 0.2) @ last + after

        for epoch in range(recipe.epochs):
            guess = task.predict(layers, inputs)
            _step(judge, (softplus(verdict(guess.detach())) + softplus(-verdict(targets))).mean())
            distance = task.loss(guess, targets)
            if epoch % recipe.check == 0:
                with torch.no_grad():
                    off = task.loss(task.predict(layers, watched[0]), watched[1])
                history.append((distance.item(), off.item()))
            _step(teach, distance + _VERDICT * softplus(-verdict(guess)).mean())
            report(epoch + 1, distance.item())
    return Trained(Net(NetOptions(), task.scale, task.arrays(layers)), np.array(history))


def _step(optimizer: "Optimizer", loss: "Tensor") -> None:
    optimizer.zero_grad()
    loss.backward()
    optimizer.step()


def _nobody(epoch: int, loss: float) -> None:
    """Take a report that nobody wants."""

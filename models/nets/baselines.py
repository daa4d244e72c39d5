"""The two other kinds of net that the paper tried: convolutional and adversarial (section 2.1).

The paper gives neither sizes nor figures for them, only that they did worse. Both are of about the
size of its 2 x 32 net and learn by the same loss, equation 1.
"""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from models.data.dataset import Dataset
from models.nets.loss import distance_loss
from models.nets.net import Scaling, scale_strain, scaling
from models.nets.regression import Predictor

if TYPE_CHECKING:
    from torch import Tensor
    from torch.nn import Module
    from torch.optim import Optimizer

# Neurons of the critic, and the weight of its verdict beside the distance, mm.
_CRITIC = 32
_VERDICT = 0.1


def convolutional(
    training: Dataset, epochs: int, seed: int, learning_rate: float = 1e-3
) -> Predictor:
    """Train a net that slides two kernels of 5 gauges along the ring before a layer of 32.

    Parameters
    ----------
    training
        The gauges in the order of the ring, as `gauge_layout` gives them; its ends meet.
    epochs
        Steps of Adam, each over the whole training set.
    seed
        Of the first weights.
    """
    import torch
    from torch import nn

    torch.manual_seed(seed)
    gauges = training.strain.shape[1] // 3
    # One row of an image, three numbers a gauge: the kernels step from gauge to gauge, 3 columns.
    net = nn.Sequential(
        nn.Unflatten(1, (1, 3 * gauges)),
        nn.Conv1d(1, 8, 15, stride=3, padding=6, padding_mode="circular"),
        nn.ReLU(),
        nn.Conv1d(8, 8, 5, stride=2, padding=2, padding_mode="circular"),
        nn.ReLU(),
        nn.Flatten(),
        nn.Linear(8 * -(-gauges // 2), 32),
        nn.ReLU(),
        nn.Linear(32, training.targets.shape[1]),
    )
    scale = scaling(training.strain)
    inputs, targets = _tensors(scale, training)
    adam = torch.optim.Adam(net.parameters(), lr=learning_rate, fused=True)
    for _ in range(epochs):
        _step(adam, distance_loss()(net(inputs), targets))
    return _predictor(net, scale)


def adversarial(
    training: Dataset, epochs: int, seed: int, learning_rate: float = 1e-3
) -> Predictor:
    """Train a 2 x 32 net against a critic that separates its places from true ones.

    A conditional adversarial pair (Mirza and Osindero 2014): the critic sees the strains too. The
    net takes the distance to the true place and the critic's verdict together as its loss.

    Parameters
    ----------
    training
        Touches to learn from.
    epochs
        Steps of Adam, one of the critic and one of the net each.
    seed
        Of the first weights.
    """
    import torch
    from torch import nn

    torch.manual_seed(seed)
    columns, outputs = training.strain.shape[1], training.targets.shape[1]
    net = nn.Sequential(
        nn.Linear(columns, 32), nn.ReLU(), nn.Linear(32, 32), nn.ReLU(), nn.Linear(32, outputs)
    )
    critic = nn.Sequential(
        nn.Linear(columns + outputs, _CRITIC), nn.LeakyReLU(0.2), nn.Linear(_CRITIC, 1)
    )
    scale = scaling(training.strain)
    inputs, targets = _tensors(scale, training)
    adam = partial(torch.optim.Adam, lr=learning_rate, fused=True)
    teach, judge = adam(net.parameters()), adam(critic.parameters())
    softplus = nn.functional.softplus

    def verdict(places: "Tensor") -> "Tensor":
        return critic(torch.cat([inputs, places / 100.0], dim=1))

    for _ in range(epochs):
        guess = net(inputs)
        _step(judge, (softplus(verdict(guess.detach())) + softplus(-verdict(targets))).mean())
        _step(teach, distance_loss()(guess, targets) + _VERDICT * softplus(-verdict(guess)).mean())
    return _predictor(net, scale)


def _tensors(scale: Scaling, data: Dataset) -> tuple["Tensor", "Tensor"]:
    import torch

    inputs = scale_strain(scale, data.strain)
    return torch.tensor(inputs, dtype=torch.float32), torch.tensor(
        data.targets, dtype=torch.float32
    )


def _step(optimizer: "Optimizer", loss: "Tensor") -> None:
    optimizer.zero_grad()
    loss.backward()
    optimizer.step()


def _predictor(net: "Module", scale: Scaling) -> Predictor:
    import torch

    def predict(strain: np.ndarray) -> np.ndarray:
        inputs = torch.tensor(scale_strain(scale, strain), dtype=torch.float32)
        with torch.no_grad():
            return net(inputs).numpy()

    return predict

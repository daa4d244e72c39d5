"""Nets: fully connected layers from strains to a place, as plain arrays.

A net runs on NumPy alone, so that scoring and live use of a stored net import no torch;
`models.train` differentiates the same `forward` with torch tensors in place of arrays.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal, get_args

import numpy as np

__all__ = ["Activation", "Net", "NetOptions", "Scaling", "forward", "initial", "predict", "scaling"]

Activation = Literal["relu", "tanh", "silu"]
Layer = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class NetOptions:
    """Architecture of a net.

    Attributes
    ----------
    layers
        Neurons of each hidden layer.
    activation
        After each hidden layer; the output layer is linear.

    Raises
    ------
    ValueError
        When a layer has no neuron or the activation is unknown.
    """

    layers: tuple[int, ...] = (32, 32)
    activation: Activation = "relu"

    def __post_init__(self) -> None:
        if any(neurons < 1 for neurons in self.layers):
            raise ValueError(
                f"neurons of a layer must be at least 1, got layers {list(self.layers)}; "
                "use [32, 32]"
            )
        if self.activation not in get_args(Activation):
            raise ValueError(
                f"activation must be one of {', '.join(get_args(Activation))}, "
                f"got {self.activation!r}; use 'relu'"
            )


@dataclass(frozen=True)
class Scaling:
    """Constants that bring the strains to the size that a net starts from.

    Attributes
    ----------
    centre
        (I,) float64, strain per newton, subtracted from each input.
    scale
        (I,) float64, strain per newton, divides each input.
    """

    centre: np.ndarray
    scale: np.ndarray


@dataclass(frozen=True)
class Net:
    """A net that can be run and stored.

    Attributes
    ----------
    options
        Its architecture.
    scaling
        Of its inputs.
    layers
        Weights (inputs, outputs) and biases (outputs,) of each layer, float32.
    """

    options: NetOptions
    scaling: Scaling
    layers: tuple[Layer, ...]


def scaling(strain: np.ndarray) -> Scaling:
    """Return the standardisation of `strain` (N, I): mean and standard deviation of each input.

    The paper does not say how it scaled its inputs. Strains per newton are about 1e-4, where a
    net with the usual start learns nothing, so some scaling there must be. An input that does not
    vary (a strain that a clamped edge forbids) is left as large as it is: dividing it by its own
    rounding error would make a signal of noise.
    """
    deviation = strain.std(axis=0)
    live = deviation > 1e-9 * deviation.max(initial=0.0)
    return Scaling(strain.mean(axis=0), np.where(live, deviation, 1.0))


def initial(sizes: Sequence[int], rng: np.random.Generator) -> tuple[Layer, ...]:
    """Return the layers that training starts from, Glorot uniform with zero biases.

    Glorot and Bengio (2010), equation 16, the default of the library that the paper used.

    Parameters
    ----------
    sizes
        Inputs, neurons of each hidden layer, outputs.
    rng
        Source of the weights.

    Returns
    -------
    Weights (inputs, outputs) and biases (outputs,) of each layer, float32.
    """
    return tuple(
        (
            (rng.uniform(-1.0, 1.0, (n, m)) * np.sqrt(6.0 / (n + m))).astype(np.float32),
            np.zeros(m, np.float32),
        )
        for n, m in pairwise(sizes)
    )


def forward(
    layers: Sequence[tuple[Any, Any]], inputs: Any, activation: Callable[[Any], Any]
) -> Any:
    """Run the layers on scaled `inputs`; arrays and tensors alike."""
    *hidden, (weights, biases) = layers
    for hidden_weights, hidden_biases in hidden:
        inputs = activation(inputs @ hidden_weights + hidden_biases)
    return inputs @ weights + biases


def predict(net: Net, strain: np.ndarray) -> np.ndarray:
    """Return the places that a net sees in `strain`.

    Parameters
    ----------
    net
        As trained or loaded.
    strain
        (N, I) float64, strain per newton, columns as in the data set that it was trained on.

    Returns
    -------
    (N, 2) float64, mm.

    Raises
    ------
    ValueError
        When the number of columns is not that of the net.
    """
    strain = np.atleast_2d(np.asarray(strain, dtype=float))
    if strain.shape[1] != len(net.scaling.centre):
        raise ValueError(
            f"strains of a touch must be {len(net.scaling.centre)}, got {strain.shape[1]}; "
            "use the gauges that the net was trained with"
        )
    inputs = (strain - net.scaling.centre) / net.scaling.scale
    return forward(net.layers, inputs, _activation(net.options.activation))


def _activation(name: Activation) -> Callable[[np.ndarray], np.ndarray]:
    match name:
        case "relu":
            return lambda x: np.maximum(x, 0.0)
        case "tanh":
            return np.tanh
        case "silu":
            return lambda x: x * 0.5 * (1.0 + np.tanh(0.5 * x))  # x σ(x), without overflow

"""Nets: fully connected layers from strains to a place, as plain arrays.

A net runs on NumPy alone, so that scoring and live use of a stored net import no torch;
`models.nets.train` differentiates the same `forward` with torch tensors in place of arrays.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal, get_args

import numpy as np

from models.nets.set_encoding import decode

Activation = Literal["relu", "tanh", "silu"]
Inputs = Literal["standard", "asinh", "relative"]
Start = Literal["glorot", "he"]
Layer = tuple[np.ndarray, np.ndarray]

KNEE = 0.03
"""Knee of asinh inputs as part of the largest root mean square strain of a gauge; of 0.03, 0.1 and
0.3 the one with the smallest error on the paper's touches (0.017, 0.028 and 0.029 mm)."""


@dataclass(frozen=True)
class NetOptions:
    """Architecture of a net.

    Attributes
    ----------
    layers
        Neurons of each hidden layer.
    activation
        After each hidden layer; the output layer is linear.
    inputs
        "standard" subtracts the mean of each strain and divides by its deviation. "asinh" before
        takes the inverse hyperbolic sine, which spreads the many small strains: those of a touch
        far from a gauge are a hundredth of those of a near one, and say as much of its place.
        "relative" before divides the strains of a sample by their norm, so that a net of places
        does not see how hard a touch presses.
    poles
        Touches of a sample where the net reports them without an order, by `set_encoding`; 0 where
        its outputs are the targets as they stand.

    Raises
    ------
    ValueError
        When a layer has no neuron, the activation or the inputs are unknown, or `poles` is
        negative.
    """

    layers: tuple[int, ...] = (32, 32)
    activation: Activation = "relu"
    inputs: Inputs = "standard"
    poles: int = 0

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
        if self.inputs not in get_args(Inputs):
            raise ValueError(
                f"inputs must be one of {', '.join(get_args(Inputs))}, got {self.inputs!r}; "
                "use 'standard'"
            )
        if self.poles < 0:
            raise ValueError(f"touches as poles must be 0 or more, got {self.poles}; use 0")


@dataclass(frozen=True)
class Scaling:
    """Constants that bring the strains to the size that a net starts from.

    Attributes
    ----------
    centre
        (I,) float64, subtracted from each input.
    scale
        (I,) float64, divides each input.
    knee
        Strain below which the inverse hyperbolic sine that comes first is straight; None for none.
    relative
        Whether the strains of a sample are divided by their norm first.
    """

    centre: np.ndarray
    scale: np.ndarray
    knee: float | None = None
    relative: bool = False


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
        Weights (inputs, outputs) and biases (outputs,) of each layer.
    """

    options: NetOptions
    scaling: Scaling
    layers: tuple[Layer, ...]


def scaling(strain: np.ndarray, inputs: Inputs = "standard") -> Scaling:
    """Return the standardisation of `strain` (N, I): mean and standard deviation of each input.

    The paper does not say how it scaled its inputs. Strains per newton are about 1e-4, where a
    net with the usual start learns nothing, so some scaling there must be. An input that does not
    vary (a strain that a clamped edge forbids) is left as large as it is: dividing it by its own
    rounding error would make a signal of noise.
    """
    knee = None
    if inputs == "asinh":
        knee = KNEE * float(np.sqrt((strain**2).mean(axis=0).max()))
        strain = np.arcsinh(strain / knee)
    if inputs == "relative":
        strain = _relative(strain)
    deviation = strain.std(axis=0)
    live = deviation > 1e-9 * deviation.max(initial=0.0)
    return Scaling(strain.mean(axis=0), np.where(live, deviation, 1.0), knee, inputs == "relative")


def scale_strain(scaling: Scaling, strain: np.ndarray) -> np.ndarray:
    """Return what a net is fed for `strain` (N, I)."""
    if scaling.knee is not None:
        strain = np.arcsinh(strain / scaling.knee)
    if scaling.relative:
        strain = _relative(strain)
    return (strain - scaling.centre) / scaling.scale


def _relative(strain: np.ndarray) -> np.ndarray:
    """Divide each row by its norm; one of zeros stays."""
    norm = np.linalg.norm(strain, axis=1, keepdims=True)
    return strain / np.where(norm > 0.0, norm, 1.0)


def initial(
    sizes: Sequence[int], rng: np.random.Generator, start: Start = "glorot"
) -> tuple[Layer, ...]:
    """Return the layers that training starts from: uniform weights, zero biases.

    "glorot" is Glorot and Bengio (2010), equation 16, the default of the library that the paper
    used; "he" keeps the size of what rectified layers hand on, He et al. (2015), equation 10.

    Parameters
    ----------
    sizes
        Inputs, neurons of each hidden layer, outputs.
    rng
        Source of the weights.
    start
        By which rule they are drawn.

    Returns
    -------
    Weights (inputs, outputs) and biases (outputs,) of each layer, float32.
    """
    he = start == "he"
    return tuple(
        (
            (rng.uniform(-1.0, 1.0, (n, m)) * np.sqrt(6.0 / (n if he else n + m))).astype(
                np.float32
            ),
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
    """Return what a net sees in `strain`.

    Parameters
    ----------
    net
        As trained or loaded.
    strain
        (N, I) float64, strain per newton, columns as in the data set that it was trained on.

    Returns
    -------
    (N, D) float64, columns as the targets that it was trained on: x, y of a touch, mm, first.

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
    reported = forward(
        net.layers, scale_strain(net.scaling, strain), _activation(net.options.activation)
    )
    return decode(reported, net.options.poles) if net.options.poles else reported


def _activation(name: Activation) -> Callable[[np.ndarray], np.ndarray]:
    match name:
        case "relu":
            return lambda x: np.maximum(x, 0.0)
        case "tanh":
            return np.tanh
        case "silu":
            return lambda x: x * 0.5 * (1.0 + np.tanh(0.5 * x))  # x σ(x), without overflow

"""Losses of the paper, equations 1 to 4, on tensors of torch.

The columns of targets are those of `dataset.flatten`: the places, then what else is reported.
"""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torch import Tensor

Loss = Callable[["Tensor", "Tensor"], "Tensor"]
"""Predictions and targets of a batch in, the loss out."""


def distance_loss(touches: int = 1) -> Loss:
    """Return equations 1 and 2: the mean distance of predicted and true touches, mm.

    Parameters
    ----------
    touches
        Number of touches of a sample; the targets are x1, y1, x2, y2, ...
    """

    def loss(predicted: "Tensor", true: "Tensor") -> "Tensor":
        apart = (predicted - true)[:, : 2 * touches]
        return apart.reshape(-1, 2).norm(dim=1).mean()  # pyright: ignore[reportUnknownVariableType]

    return loss


def magnitude_loss(touches: int, k: float) -> Loss:
    """Return equation 3: the distance, and k times the relative error of the magnitudes.

    Parameters
    ----------
    touches
        Number of touches of a sample; the targets are x1, y1, x2, ..., m1, m2, ...
    k
        Weight of the magnitudes, mm.
    """
    place = distance_loss(touches)

    def loss(predicted: "Tensor", true: "Tensor") -> "Tensor":
        error = predicted[:, 2 * touches :] / true[:, 2 * touches :] - 1.0
        return place(predicted, true) + k * error.abs().mean()

    return loss


def base_loss(k: float) -> Loss:
    """Return equation 4: the distance, and k times the error of bend and twist together.

    Parameters
    ----------
    k
        Weight of what follows x and y in the targets, mm for each of its units.
    """
    place, base = distance_loss(), error_sum()

    def loss(predicted: "Tensor", true: "Tensor") -> "Tensor":
        return place(predicted, true) + k * base(predicted[:, 2:], true[:, 2:])

    return loss


def error_sum() -> Loss:
    """Return the second part of equation 4: the sum of the errors of all targets."""
    return lambda predicted, true: (predicted - true).abs().sum(dim=1).mean()


def mean_square() -> Loss:
    """Return the mean square of all errors, whose root a bound on variances is about."""
    return lambda predicted, true: ((predicted - true) ** 2).mean()

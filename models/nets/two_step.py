"""A touch on a deformable surface in two steps, section 2.3 of the paper (its figure 5B).

The first net estimates bend and twist of the base from the strain before the touch; the second
estimates the place from the strain under the touch together with what the first has reported.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from models.data.dataset import Dataset
from models.nets.batches import shuffled_batches
from models.nets.checkpoint import Checkpoint
from models.nets.loss import distance_loss, error_sum
from models.nets.net import Net, NetOptions, predict
from models.nets.recipe import Recipe
from models.nets.train import Trained, train_net

Seen = Literal["total", "change", "direction"]


@dataclass(frozen=True)
class DeformableSurface:
    """Touches on bases that differ.

    Attributes
    ----------
    before
        (N, I) float, Strain_B&T: of the base alone.
    loaded
        (N, I) float, Strain_L: of base and touch.
    base
        (N, 2) float, Δl in mm and Δθ in degrees.
    xy
        (N, 2) float, mm, places of the touches.
    """

    before: np.ndarray
    loaded: np.ndarray
    base: np.ndarray
    xy: np.ndarray

    @property
    def shapes(self) -> Dataset:
        """What the first net learns from."""
        return Dataset(self.before, self.base)

    @property
    def together(self) -> Dataset:
        """What the paper's single net learns from, with the loss of equation 4."""
        return Dataset(self.loaded, np.column_stack([self.xy, self.base]))


@dataclass(frozen=True)
class TwoStep:
    """Both nets.

    Attributes
    ----------
    shape
        Sub-model 1: strain before the touch to bend and twist.
    place
        Sub-model 2: bend, twist and strain under the touch to its place.
    strain
        What sub-model 2 sees of the strain: "total" as the paper, the "change" since before the
        touch, or its "direction", the change over its norm, which no load alters.
    """

    shape: Net
    place: Net
    strain: Seen = "total"

    def __post_init__(self) -> None:
        if self.strain not in get_args(Seen):
            raise ValueError(
                f"strain of the second step must be one of {', '.join(get_args(Seen))}, "
                f"got {self.strain!r}; use 'total'"
            )


@dataclass(frozen=True)
class TrainedTwoStep:
    """What training in two steps ends in: each net with its history, and what the second sees."""

    shape: Trained
    place: Trained
    strain: Seen = "total"

    @property
    def nets(self) -> TwoStep:
        """Both nets, to be run."""
        return TwoStep(self.shape.net, self.place.net, self.strain)

    def steps(self) -> dict[str, Trained]:
        """Both trainings by name."""
        return {"shape": self.shape, "place": self.place}

    def sound(self) -> "TrainedTwoStep":
        """Return itself, if the second net takes what the first reports."""
        nets = self.nets
        gauges, fed = (len(net.scaling.centre) for net in (nets.shape, nets.place))
        reported = len(nets.shape.layers[-1][1])
        if fed != gauges + reported:
            raise ValueError(f"a second net of {fed} inputs where {gauges + reported} must be")
        return self


def train_shape(
    sets: tuple[DeformableSurface, DeformableSurface],
    options: NetOptions,
    recipe: Recipe,
    rng: np.random.Generator,
    size: int | None = None,
    on_epoch: Callable[[int, float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> Trained:
    """Train sub-model 1, from the strain before the touch to bend and twist.

    Parameters
    ----------
    sets
        One to learn from, and one to watch.
    options, recipe
        Of the net and its training; 64 × 4 in the paper.
    rng
        Source of the initial weights and of the batches.
    size
        Samples of a batch; all of them where it is not given.
    on_epoch, checkpoint
        As for `train_net`.
    """
    training, validation = sets
    return train_net(
        training.shapes,
        validation.shapes,
        options,
        recipe,
        rng,
        on_epoch,
        error_sum(),
        shuffled_batches(training.shapes, size or len(training.xy), rng),
        checkpoint,
    )


def train_place(
    shape: Net,
    sets: tuple[DeformableSurface, DeformableSurface],
    options: NetOptions,
    recipe: Recipe,
    rng: np.random.Generator,
    strain: Seen = "total",
    size: int | None = None,
    on_epoch: Callable[[int, float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> Trained:
    """Train sub-model 2, on what the first net reports and not on the true base.

    Parameters are those of `train_shape`; 128 × 4 in the paper. `strain` is that of `TwoStep`.
    """
    data, watched = (
        Dataset(_beside(shape, each.before, each.loaded, strain), each.xy) for each in sets
    )
    drawn = shuffled_batches(data, size or len(data), rng)
    return train_net(
        data, watched, options, recipe, rng, on_epoch, distance_loss(), drawn, checkpoint
    )


def predict_two_step(nets: TwoStep, before: np.ndarray, loaded: np.ndarray) -> np.ndarray:
    """Return the places (N, 2) mm from strains before and under the touch, (N, I) each."""
    return predict(nets.place, _beside(nets.shape, before, loaded, nets.strain))


def _beside(shape: Net, before: np.ndarray, loaded: np.ndarray, strain: Seen) -> np.ndarray:
    """Return what the second net is fed: what the first reports, and the strain it sees."""
    base, change = predict(shape, before), loaded - before
    match strain:
        case "total":
            return np.column_stack([base, loaded])
        case "change":
            return np.column_stack([base, change])
        case "direction":
            norm = np.linalg.norm(change, axis=1, keepdims=True)
            return np.column_stack([base, change / np.where(norm > 0.0, norm, 1.0)])

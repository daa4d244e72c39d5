"""A touch on a deformable surface in two steps, section 2.3 of the paper (its figure 5B).

The first net estimates bend and twist of the base from the strain before the touch; the second
estimates the place from the strain under the touch together with what the first has reported.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from models.data.dataset import Dataset
from models.nets.batches import shuffled_batches
from models.nets.loss import distance_loss, error_sum
from models.nets.net import Net, NetOptions, predict
from models.nets.recipe import Recipe
from models.nets.train import train_net

if TYPE_CHECKING:
    from models.nets.loss import Loss


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
    """

    shape: Net
    place: Net


def train_two_step(
    training: DeformableSurface,
    validation: DeformableSurface,
    options: tuple[NetOptions, NetOptions],
    recipe: Recipe,
    rng: np.random.Generator,
    size: int = 512,
) -> TwoStep:
    """Train both nets, the second on what the first reports and not on the true base.

    Parameters
    ----------
    training, validation
        Only the first is learnt from.
    options
        Of both nets; 64 × 4 and 128 × 4 in the paper.
    recipe
        Of both trainings.
    rng
        Source of the initial weights and of the batches.
    size
        Samples of a batch.
    """

    def descend(data: Dataset, watched: Dataset, options: NetOptions, loss: "Loss") -> Net:
        drawn = shuffled_batches(data, size, rng)
        return train_net(data, watched, options, recipe, rng, loss=loss, batches=drawn).net

    shape = descend(training.shapes, validation.shapes, options[0], error_sum())
    reported, watched = (
        Dataset(_beside(shape, each.before, each.loaded), each.xy)
        for each in (training, validation)
    )
    return TwoStep(shape, descend(reported, watched, options[1], distance_loss()))


def predict_two_step(nets: TwoStep, before: np.ndarray, loaded: np.ndarray) -> np.ndarray:
    """Return the places (N, 2) mm from strains before and under the touch, (N, I) each."""
    return predict(nets.place, _beside(nets.shape, before, loaded))


def _beside(shape: Net, before: np.ndarray, loaded: np.ndarray) -> np.ndarray:
    return np.column_stack([predict(shape, before), loaded])

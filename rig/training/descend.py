"""From a plan and its touches to a trained model, whatever kind the scene asks for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig.scene.sensing import NetEstimator, RegressionEstimator
from rig.training.bases import BaseSets, simulate_bases
from rig.training.data import TrainingSets, simulate_sets

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from models import Checkpoint, Dataset, Loss, Model, NetOptions, Recipe, Trained, TrainedTwoStep
    from rig.training.plan import TrainingPlan

    Progress = Callable[[int, float], None]

Sets = TrainingSets | BaseSets
"""Touches on a flat plate, or on bases."""

BATCHES_A_CHECK = 100
"""A check on the validation set costs as much as several batches."""


def simulate(plan: TrainingPlan, report: Callable[[int, int], None]) -> Sets:
    """Return what a scene learns from; `report` is called while plates are solved."""
    if plan.training.bases:
        return simulate_bases(plan, report)
    return simulate_sets(plan, report)


def train_model(
    plan: TrainingPlan, sets: Sets, part: Path | None = None, on_epoch: Progress | None = None
) -> Model:
    """Train whatever a scene asks for.

    Parameters
    ----------
    plan, sets
        Of the scene.
    part
        Where a training keeps what it has reached, so that one that was killed goes on; a net of
        two steps keeps its first net beside. Both are removed in the end.
    on_epoch
        Called with the epochs done and the loss.

    Raises
    ------
    ValueError
        If the loss stops being finite, torch is missing, or a checkpoint is damaged.
    """
    from models import Checkpoint, Regression

    net, kept = plan.net, Checkpoint(part) if part else None
    if isinstance(sets, BaseSets):
        return _on_bases(plan, sets, part, on_epoch)
    if isinstance(net, RegressionEstimator):
        return Regression(net.fit, sets.training)
    return descend(plan, sets, net.layers, on_epoch, kept)


def descend(
    plan: TrainingPlan,
    sets: TrainingSets,
    layers: tuple[int, ...],
    on_epoch: Progress | None = None,
    checkpoint: Checkpoint | None = None,
) -> Trained:
    """Train a net with these layers by the recipe of a scene."""
    from models import train_adversarial, train_convolutional, train_net

    net, rng = plan.descent, np.random.default_rng(plan.descent.seed)
    plain = sets.training, sets.validation, recipe(net), rng, on_epoch
    match net.family:
        case "convolutional":
            return train_convolutional(*plain, checkpoint)
        case "adversarial":
            return train_adversarial(*plain)
        case "dense":
            return train_net(
                sets.training,
                sets.validation,
                options(net, layers, plan.touches),
                recipe(net),
                rng,
                on_epoch,
                _loss(plan),
                _batches(plan, sets),
                checkpoint,
            )


def recipe(net: NetEstimator) -> Recipe:
    """Return how the net of a scene is trained."""
    from models import Recipe

    return Recipe(
        net.epochs,
        net.learning_rate,
        net.decay,
        net.outputs,
        net.lbfgs_steps,
        check(net),
        net.start,
    )


def options(net: NetEstimator, layers: tuple[int, ...], touches: int = 1) -> NetOptions:
    """Return the architecture of the net of a scene."""
    from models import NetOptions

    poles = touches if net.target_encoding == "rational" else 0
    return NetOptions(layers, net.activation, net.inputs, poles)


def check(net: NetEstimator) -> int:
    """Return the epochs between two checks on the validation set."""
    return BATCHES_A_CHECK if net.batch else 1


def _on_bases(
    plan: TrainingPlan, sets: BaseSets, part: Path | None, on_epoch: Progress | None
) -> Trained | TrainedTwoStep:
    """Train one net of place and base, or one of the base and then one of the place."""
    from models import Checkpoint, base_loss, shuffled_batches, train_net

    net = plan.descent
    if net.base_layers:
        return _two_steps(plan, sets, part, on_epoch)
    rng = np.random.default_rng(net.seed)
    training, validation = (each.surface().together for each in (sets.training, sets.validation))
    stream = shuffled_batches(training, net.batch, rng) if net.batch else None
    kept = Checkpoint(part) if part else None
    loss = base_loss(net.base_weight)
    shape = options(net, net.layers)
    return train_net(training, validation, shape, recipe(net), rng, on_epoch, loss, stream, kept)


def _two_steps(
    plan: TrainingPlan, sets: BaseSets, part: Path | None, on_epoch: Progress | None
) -> TrainedTwoStep:
    from models import Checkpoint, TrainedTwoStep, train_place, train_shape

    net = plan.descent
    touches = sets.training.surface(), sets.validation.surface()
    kept = Checkpoint(part) if part else None
    first = part.with_suffix(".first.h5") if part else None
    rng = np.random.default_rng(net.seed)
    shape = _kept_shape(first, plan)
    if shape is None:
        before = options(net, net.base_layers or ())
        shape = train_shape(touches, before, recipe(net), rng, net.batch, on_epoch, kept)
        _keep_shape(first, plan, shape)
    # Its own stream of random numbers, so that a run that goes on here draws the same.
    rng = np.random.default_rng([net.seed, 1])
    after = options(net, net.layers)
    place = train_place(
        shape.net,
        touches,
        after,
        recipe(net),
        rng,
        net.base_strain,
        net.batch,
        on_epoch,
        kept,
    )
    if first:
        first.unlink(missing_ok=True)
    return TrainedTwoStep(shape, place, net.base_strain)


def _kept_shape(path: Path | None, plan: TrainingPlan) -> Trained | None:
    """Return the first net of a run that was killed in its second, if it is of the same scene."""
    from models import load_net

    if path is None or not path.is_file():
        return None
    trained, about = load_net(path)
    return trained if about.get("plan") == plan.dump() else None


def _keep_shape(path: Path | None, plan: TrainingPlan, shape: Trained) -> None:
    from models import save_net

    if path:
        save_net(path, shape, {"plan": plan.dump()})


def _batches(plan: TrainingPlan, sets: TrainingSets) -> Iterator[Dataset] | None:
    """Draw what each step learns from; None where it is all of the training set."""
    from models import mixed_batches, noisy_batches, shuffled_batches

    size, rng = plan.descent.batch, np.random.default_rng(plan.descent.seed)
    if sets.noise is None:
        return shuffled_batches(sets.training, size, rng) if size else None
    pool, images = sets.noise.pool, sets.noise.images
    size = min(size or len(pool), len(pool))
    stream = noisy_batches(shuffled_batches(pool, size, rng), sets.noise.root, rng)
    if images is None:
        return stream
    few = max(round(size * plan.training.rendered_fraction), 1)
    return mixed_batches(stream, shuffled_batches(images, few, rng))


def _loss(plan: TrainingPlan) -> Loss:
    """Return equation 2 or 3 of the paper, for what the net of a scene estimates."""
    from models import distance_loss, magnitude_loss, permutation_invariant_loss

    weight = plan.descent.magnitude_weight
    if plan.descent.target_encoding == "rational":
        return permutation_invariant_loss(plan.touches, weight)
    return magnitude_loss(plan.touches, weight) if plan.magnitudes else distance_loss(plan.touches)

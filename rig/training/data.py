"""The simulated touches of a scene: what its net is trained, validated and tested on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig.plates.cached import influence
from rig.scene.dataset import DatasetSection
from rig.scene.sensing import TrainingSection
from rig.training.plan import TrainingPlan

if TYPE_CHECKING:
    from collections.abc import Callable

    from models import Dataset, LinearForward, StrainInfluence


@dataclass(frozen=True, eq=False)
class TrainingSets:
    """A set to learn from, one to watch, one for the test.

    Of one touch: a grid or random places, places between, random places. Of several: the samples of
    the scene, and random ones for the others.

    Attributes
    ----------
    noise : TrainingNoise or None
        What is drawn anew for each batch.
    """

    training: Dataset
    validation: Dataset
    test: Dataset
    noise: TrainingNoise | None = None

    def named(self) -> dict[str, Dataset]:
        """Return the three by their names."""
        return {"training": self.training, "validation": self.validation, "test": self.test}


@dataclass(frozen=True, eq=False)
class TrainingNoise:
    """Touches without noise, and what to add to them.

    Attributes
    ----------
    pool : Dataset
    root : float or (I, I) float32, strain
        Standard deviation, or root of the covariance.
    images : Dataset or None
        Read by DIC in rendered images, with the noise that is in these.
    towards : (m, I) float64
        From strains to numbers with white noise.
    forward : LinearForward
        Of these numbers: what bounds an estimate of the touches.
    forces : (N,) float64, N
        Of the test touches.
    """

    pool: Dataset
    root: float | np.ndarray
    images: Dataset | None
    towards: np.ndarray
    forward: LinearForward
    forces: np.ndarray


def simulate_sets(plan: TrainingPlan, report: Callable[[int, int], None]) -> TrainingSets:
    """Return the three data sets; `report` is called while the influence is not in the cache."""
    from models import grid_places, midpoint_places, random_places

    if plan.samples:
        return _several(plan, plan.samples, report)
    size, training = plan.plate.size, plan.training
    spacing, margin = training.spacing, training.margin
    rng = np.random.default_rng(training.test_seed)
    drawn = random_places(size, margin, training.test_samples, rng)
    between = midpoint_places(size, spacing, margin, training.validation_side)
    if training.samples:
        grid = random_places(size, margin, training.samples, rng)
    else:
        grid = grid_places(size, spacing, margin)
    if plan.view or training.noise:
        return _noisy(plan, (grid, between, drawn), rng, report)
    touches = influence(plan.plate.build(), plan.gauges.build(plan.plate), report)
    force = training.force[1]
    sets = [_at_force(touches, places, force) for places in (grid, between, drawn)]
    return TrainingSets(sets[0], sets[1], sets[2])


def _at_force(plate: StrainInfluence, places: np.ndarray, force: float | np.ndarray) -> Dataset:
    """Return what gauges read of touches at places (N, 2), of one force or one each."""
    from models import Dataset, simulate_dataset

    unit = simulate_dataset(plate, places)
    return Dataset(unit.strain * np.reshape(force, (-1, 1)), unit.targets)


def _noisy(
    plan: TrainingPlan,
    places: tuple[np.ndarray, ...],
    rng: np.random.Generator,
    report: Callable[[int, int], None],
) -> TrainingSets:
    """Return touches of random forces with noise: that of the gauges, or of images of them."""
    from models import Dataset, noisy_batches, random_places

    training, images = plan.training, None
    forces = [_draw(training, len(each), rng) for each in places]
    if plan.view:
        from rig.training.rendered_gauges import render_gauges

        rendered = render_gauges(plan.view, report)
        plate, root = rendered.seen, rendered.root.astype(np.float32)
        white = rendered.seen.white(rendered.root)
        towards, forward = white.whitening, white.forward
        if training.rendered_images:
            seen = random_places(plan.plate.size, training.margin, training.rendered_images, rng)
            touches = np.column_stack([seen, _draw(training, len(seen), rng)])
            images = Dataset(rendered.correlate(touches, rng), seen)
    else:
        from models import gauge_forward

        plate = influence(plan.plate.build(), plan.gauges.build(plan.plate), report)
        root = float(training.noise * np.sqrt(np.mean(plate.strain(places[0]) ** 2)))
        towards, forward = np.eye(3 * len(plate.gauges)) / root, gauge_forward(plate, root)
    clear = [_at_force(plate, *each) for each in zip(places, forces, strict=True)]
    drawn = [next(noisy_batches(iter([each]), root, rng)) for each in clear]
    noise = TrainingNoise(clear[0], root, images, towards, forward, forces[2])
    return TrainingSets(drawn[0], drawn[1], drawn[2], noise)


def _draw(training: TrainingSection, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draw forces evenly in their logarithm, (count,) N."""
    low, high = np.log(training.force)
    return np.exp(rng.uniform(low, high, count))


def _several(
    plan: TrainingPlan, samples: DatasetSection, report: Callable[[int, int], None]
) -> TrainingSets:
    """Return samples of several touches, superposed."""
    import models
    from models import flatten_samples

    plate, training = plan.plate, plan.training
    touches = influence(plate.build(), plan.gauges.build(plate), report)
    answer = models.superpose(touches.strain)
    unit = samples.force if plan.magnitudes else None

    def collect(section: DatasetSection) -> Dataset:
        sampling = section.build(plate)
        blocks = [sampling.block(number) for number in range(sampling.blocks)]
        strain = np.concatenate([answer(block).astype(np.float32) for block in blocks])
        return flatten_samples(strain, np.concatenate(blocks), unit)

    random = {"places": "random", "order": "canonical", "samples": training.test_samples}
    watched, tested = (
        samples.model_copy(update=random | {"seed": training.test_seed + later}) for later in (1, 0)
    )
    return TrainingSets(collect(samples), collect(watched), collect(tested))


def model_path(scene: str | Path) -> Path:
    """Return where the model of a scene lies unless it was put elsewhere."""
    return Path("results") / Path(scene).stem / "model.h5"

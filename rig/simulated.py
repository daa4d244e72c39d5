"""The simulated touches of a scene: what its net is trained, validated and tested on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig import cache
from rig.scene.bench import Ring
from rig.scene.dataset import Dataset as Samples
from rig.scene.plate import Plate
from rig.scene.scene import Scene
from rig.scene.sensing import NetEstimator, Training
from rig.scene.theory import require_linear

if TYPE_CHECKING:
    from collections.abc import Callable

    import fe
    from models.dataset import Dataset

__all__ = ["Lesson", "Sets", "influence", "lesson", "model_path", "reduced", "simulate"]


@dataclass(frozen=True)
class Lesson:
    """The sections of a scene that a net is trained from, all of them there."""

    plate: Plate
    gauges: Ring
    training: Training
    net: NetEstimator
    samples: Samples | None

    @property
    def touches(self) -> int:
        """Touches of a sample."""
        return self.samples.touches if self.samples else 1

    @property
    def magnitudes(self) -> bool:
        """Whether the net tells how hard each touch presses."""
        return self.samples is not None and self.samples.magnitudes > 1


@dataclass(frozen=True)
class Sets:
    """A set to learn from, one to watch, one for the test.

    Of one touch: a grid, places between, random places. Of several: the samples of the scene, and
    random ones for the others.
    """

    training: Dataset
    validation: Dataset
    test: Dataset


def lesson(scene: Scene) -> Lesson:
    """Return what a net is trained from.

    Raises
    ------
    ValueError
        When the scene has no net to train, or a plate that linear theory does not serve.
    """
    match scene:
        case Scene(
            plate=Plate() as plate,
            gauges=Ring() as gauges,
            training=Training() as training,
            estimator=NetEstimator() as net,
        ):
            require_linear(scene, plate, None, "training")
            several = scene.dataset is not None and scene.dataset.touches > 1
            return Lesson(plate, gauges, training, net, scene.dataset if several else None)
        case _:
            raise ValueError(
                f"scene '{scene.title}' has no net to train; give its [estimator] kind = \"net\""
                " and add [gauges] and [training], as paper-one has them"
            )


def simulate(lesson: Lesson, report: Callable[[int, int], None]) -> Sets:
    """Return the three data sets; `report` is called while the influence is not in the cache."""
    from models import dataset

    if lesson.samples:
        return _several(lesson, lesson.samples, report)
    size, training = lesson.plate.size, lesson.training
    spacing, margin = training.spacing, training.margin
    grid = dataset.grid(size, spacing, margin)
    between = dataset.midpoints(size, spacing, margin, training.validation)
    rng = np.random.default_rng(training.test_seed)
    drawn = dataset.random_places(size, margin, training.test, rng)
    touches = influence(lesson.plate.build(), lesson.gauges.build(lesson.plate), report)
    return Sets(*(dataset.simulate(touches, places) for places in (grid, between, drawn)))


def _several(lesson: Lesson, samples: Samples, report: Callable[[int, int], None]) -> Sets:
    """Return samples of several touches, superposed."""
    import models
    from models.dataset import flatten

    plate, training = lesson.plate, lesson.training
    touches = influence(plate.build(), lesson.gauges.build(plate), report)
    answer = models.superpose(touches.strain)
    unit = samples.force if lesson.magnitudes else None

    def collect(section: Samples) -> Dataset:
        plan = section.build(plate)
        blocks = [plan.block(number) for number in range(plan.blocks)]
        strain = np.concatenate([answer(block).astype(np.float32) for block in blocks])
        return flatten(strain, np.concatenate(blocks), unit)

    random = {"places": "random", "order": "canonical", "samples": training.test}
    watched, tested = (
        samples.model_copy(update=random | {"seed": training.test_seed + later}) for later in (1, 0)
    )
    return Sets(*(collect(section) for section in (samples, watched, tested)))


def influence(
    plate: fe.Plate, gauges: np.ndarray, report: Callable[[int, int], None]
) -> fe.Influence:
    """Return the influence of touches on `gauges` (M, 2) mm, from the cache where it is there."""
    import fe

    def compute() -> cache.Arrays:
        return fe.influence(plate, gauges, progress=report).arrays()

    return fe.Influence.from_arrays(cache.fetch("influence", (fe, plate, gauges), compute))


def reduced(plate: fe.Plate, force: float, report: Callable[[int, int], None]) -> fe.Reduced:
    """Return the reduced plate for touches up to `force` N, from the cache where it is there."""
    import fe

    def compute() -> cache.Arrays:
        return fe.reduce(plate, force=force, progress=report).arrays()

    return fe.Reduced.from_arrays(cache.fetch("reduced", (fe, plate, force), compute))


def model_path(scene: str | Path) -> Path:
    """Return where the model of a scene lies unless it was put elsewhere."""
    return Path("results") / Path(scene).stem / "model.h5"

"""The simulated touches of a scene: what its net is trained, validated and tested on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig import cache
from rig.scene.bench import Ring
from rig.scene.plate import Plate
from rig.scene.scene import Scene
from rig.scene.sensing import NetEstimator, Training
from rig.scene.theory import require_linear

if TYPE_CHECKING:
    from collections.abc import Callable

    import fe
    from models.dataset import Dataset

__all__ = ["Lesson", "Sets", "influence", "lesson", "model_path", "simulate"]


@dataclass(frozen=True)
class Lesson:
    """The sections of a scene that a net is trained from, all of them there."""

    plate: Plate
    gauges: Ring
    training: Training
    net: NetEstimator


@dataclass(frozen=True)
class Sets:
    """Unit touches: a grid to learn from, places between to watch, random ones for the test."""

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
            return Lesson(plate, gauges, training, net)
        case _:
            raise ValueError(
                f"scene '{scene.title}' has no net to train; give its [estimator] kind = \"net\""
                " and add [gauges] and [training], as paper-one has them"
            )


def simulate(lesson: Lesson, report: Callable[[int, int], None]) -> Sets:
    """Return the three data sets; `report` is called while the influence is not in the cache."""
    from models import dataset

    size, training = lesson.plate.size, lesson.training
    spacing, margin = training.spacing, training.margin
    grid = dataset.grid(size, spacing, margin)
    between = dataset.midpoints(size, spacing, margin, training.validation)
    rng = np.random.default_rng(training.test_seed)
    drawn = dataset.random_places(size, margin, training.test, rng)
    touches = influence(lesson.plate.build(), lesson.gauges.build(lesson.plate), report)
    return Sets(*(dataset.simulate(touches, places) for places in (grid, between, drawn)))


def influence(
    plate: fe.Plate, gauges: np.ndarray, report: Callable[[int, int], None]
) -> fe.Influence:
    """Return the influence of touches on `gauges` (M, 2) mm, from the cache where it is there."""
    import fe

    def compute() -> cache.Arrays:
        return fe.influence(plate, gauges, progress=report).arrays()

    return fe.Influence.from_arrays(cache.fetch("influence", (fe, plate, gauges), compute))


def model_path(scene: str | Path) -> Path:
    """Return where the model of a scene lies unless it was put elsewhere."""
    return Path("results") / Path(scene).stem / "model.h5"

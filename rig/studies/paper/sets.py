"""What the paper's systems share: how much is spent, data sets, and the errors of a net."""

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

import fe
import rig
from models import Dataset, Net, position_error, predict
from models.data import dataset
from models.nets import batches
from rig.plates.cached import influence
from rig.studies.paper.table import Sample
from rig.studies.study import part
from rig.system.arrays import F64
from rig.training.data import TrainingSets, simulate_sets
from rig.training.plan import training_plan

STREAMED = 20000  # unit touches that several are drawn from
TESTED = 2000  # samples of several touches in the test

Samples = Iterator[Sample]


class Effort(NamedTuple):
    """How much is spent: seeds, and by how much epochs are cut."""

    seeds: int
    cut: int

    def epochs(self, whole: int) -> int:
        """Epochs of a training that has `whole` of them."""
        return max(whole // self.cut, 1)


@cache
def sets(*settings: str) -> TrainingSets:
    """Training, validation and test touches of paper-one, changed by key=value."""
    scene = rig.load("paper-one", dict(setting.split("=") for setting in settings))
    return simulate_sets(training_plan(scene), lambda done, total: None)


def pressed(name: str) -> tuple[fe.Plate, fe.Influence]:
    """Return the plate of a scene, and what a touch on it does to its gauges."""
    scene = rig.load(name)
    plate, gauges = part(scene.plate), part(scene.gauges)
    built = plate.build()
    return built, influence(built, gauges.build(plate), lambda done, total: None)


@cache
def several(touches: int) -> tuple[Dataset, Dataset, Dataset]:
    """Return a pool of unit touches, samples of several to scale by, and others for the test."""
    plate, answer = pressed({1: "paper-one", 2: "paper-two", 3: "paper-three"}[touches])
    rng = np.random.default_rng(1)
    pools = [
        dataset.simulate_dataset(answer, dataset.random_places(plate.size, 10.0, STREAMED, rng))
        for _ in range(2)
    ]
    first, test = (
        next(batches.superposed_batches(pool, touches, count, rng))
        for pool, count in zip(pools, (4096, TESTED), strict=True)
    )
    return pools[0], first, test


def errors(net: Net, data: Dataset) -> F64:
    """Distance of every touch of a data set of single touches, mm."""
    return position_error(data.targets, predict(net, data.strain))

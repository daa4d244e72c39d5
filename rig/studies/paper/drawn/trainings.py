"""Trainings of the paper's scenes, kept: what is there is read, what is not is trained.

A training is a scene with some of its values replaced. Its file is found by what the scene says,
beside it lies the checkpoint of one that was killed: a study that is started again goes on there.
"""

import json
import time
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

import numpy as np

import rig
from models import Model, Net, Regression, Trained, TrainedTwoStep, load_model, save_model
from rig.scene import Scene
from rig.scene.sensing import NetEstimator
from rig.system.arrays import F64
from rig.training.bases import BaseSets
from rig.training.data import TrainingSets
from rig.training.descend import Sets, check, simulate, train_model
from rig.training.model_score import predictor
from rig.training.plan import TrainingPlan, training_plan

FOLDER = Path("results/paper/trainings")
Settings = Mapping[str, object]


@dataclass(frozen=True)
class KeptTraining:
    """A model that was trained, and on what.

    Attributes
    ----------
    model
        After the last epoch.
    plan, sets
        Of its scene.
    cpu
        Seconds of a processor; of a training that was killed, those since it went on, scaled to all
        of its steps.
    """

    model: Model
    plan: TrainingPlan
    sets: Sets
    cpu: float

    @property
    def net(self) -> Net:
        """The net, where the model is one."""
        if not isinstance(self.model, Trained):
            raise TypeError(f"a {type(self.model).__name__} is no single net")
        return self.model.net

    @property
    def flat(self) -> TrainingSets:
        """The sets, where the plate is flat."""
        if isinstance(self.sets, BaseSets):
            raise TypeError("touches on bases are no touches on a flat plate")
        return self.sets

    @property
    def bent(self) -> BaseSets:
        """The sets, where the plate is bent."""
        if isinstance(self.sets, TrainingSets):
            raise TypeError("touches on a flat plate are no touches on bases")
        return self.sets

    def test(self) -> tuple[F64, F64]:
        """True and predicted targets of the test."""
        test = self.flat.test
        return test.targets, np.asarray(predictor(self.model)(test.strain))

    def curves(self) -> dict[str, F64]:
        """Epochs and both losses, (checks, 3), of each net by its name."""
        match self.model:
            case Trained():
                nets = {"": self.model}
            case TrainedTwoStep():
                nets = self.model.steps()
            case Regression():
                nets = {}
        apart = check(self.plan.descent) if nets else 1
        return {
            name: np.column_stack(
                [np.arange(1.0, 1.0 + apart * len(net.history), apart), net.history]
            ).astype(np.float64)
            for name, net in nets.items()
        }


def train_kept(scene: str, settings: Settings | None = None, seed: int = 0) -> KeptTraining:
    """Return the training of a shipped scene, changed by key=value, from the folder or anew.

    Raises
    ------
    ValueError
        If the file or the checkpoint that is kept is damaged, or of another scene.
    """
    given = dict(settings or {})
    seeded_net = isinstance(rig.load(scene, given).estimator, NetEstimator)
    seeded = {SEED: seed} if seeded_net else {}
    bench = rig.load(scene, given | seeded)
    plan, sets = training_plan(bench), simulated(scene, _of_touches(given))
    path = place(scene, bench)
    if not path.is_file():
        part, began = path.with_suffix(".part.npz"), time.process_time()
        left = 1.0 - _done(part, plan)
        model = train_model(plan, sets, part)
        spent = (time.process_time() - began) / max(left, 0.01)
        save_model(path, model, {"scene": bench.model_dump(mode="json"), "cpu": spent})
    model, about = load_model(path)
    if about.get("scene") != bench.model_dump(mode="json"):
        raise ValueError(
            f"training {path} is kept for '{bench.title}' and was made for another scene;"
            " delete it, and it is made again"
        )
    return KeptTraining(model, plan, sets, float(about["cpu"]))


def _done(part: Path, plan: TrainingPlan) -> float:
    """Return the fraction of the steps that a checkpoint has behind it; 0 where it is no such file.

    What is wrong with one that is damaged is said by the training that reads it.
    """
    try:
        with np.load(part, allow_pickle=False) as kept:
            return int(kept["epoch"]) / plan.descent.epochs
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile):
        return 0.0


SEED = "estimator.seed"


def place(name: str, bench: Scene) -> Path:
    """Return where the training of a scene is kept: a name, and what tells it from others."""
    said = bench.model_dump(mode="json", exclude_defaults=True)
    digest = sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()
    return FOLDER / f"{name}-{digest[:12]}.h5"


def _of_touches(settings: Settings) -> str:
    """Return those settings that the touches depend on, so that they are simulated once."""
    kept = {key: value for key, value in settings.items() if not key.startswith("estimator.")}
    return json.dumps(kept, sort_keys=True)


@lru_cache(maxsize=2)
def simulated(scene: str, settings: str) -> Sets:
    """Return what a scene learns from."""
    plan = training_plan(rig.load(scene, json.loads(settings)))
    return simulate(plan, lambda done, total: None)

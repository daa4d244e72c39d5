"""Trainings of the paper's scenes, kept: what is there is read, what is not is trained.

A training is a scene with some of its values replaced. Its file is found by what the scene says,
beside it lies the checkpoint of one that was killed: a study that is started again goes on there.
"""

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

import numpy as np

import rig
from models import Checkpoint, Net, load_net, save_net
from rig.scene import Scene
from rig.training.data import TrainingSets, simulate_sets
from rig.training.descend import descend
from rig.training.plan import training_plan

FOLDER = Path("results/paper/trainings")
Settings = Mapping[str, object]


@dataclass(frozen=True)
class Training:
    """A net that was trained, and how.

    Attributes
    ----------
    net
        After the last epoch.
    history
        (checks, 2) float64, training and validation loss.
    check
        Epochs between two of them.
    cpu
        Seconds of a processor; of a training that was killed, since it went on.
    sets
        What it was trained, watched and tested on.
    """

    net: Net
    history: np.ndarray
    check: int
    cpu: float
    sets: TrainingSets


def train_kept(scene: str, settings: Settings | None = None, seed: int = 0) -> Training:
    """Return the training of a shipped scene, changed by key=value, from the folder or anew."""
    bench = rig.load(scene, {**(settings or {}), "estimator.seed": seed})
    plan, sets = training_plan(bench), simulated(scene, _as_text(settings or {}))
    path = place(scene, bench)
    if not path.is_file():
        began = time.process_time()
        trained = descend(
            plan, sets, plan.descent.layers, None, Checkpoint(path.with_suffix(".npz"))
        )
        spent = time.process_time() - began
        save_net(path, trained, {"scene": bench.model_dump(mode="json"), "cpu": spent})
    trained, about = load_net(path)
    check = 100 if plan.descent.batch else 1
    return Training(trained.net, trained.history, check, float(about["cpu"]), sets)


def place(name: str, bench: Scene) -> Path:
    """Return where the training of a scene is kept: a name, and what tells it from others."""
    said = bench.model_dump(mode="json", exclude_defaults=True)
    digest = sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()
    return FOLDER / f"{name}-{digest[:12]}.h5"


def _as_text(settings: Settings) -> str:
    """Return what of the settings the touches depend on, so that they are simulated once."""
    kept = {key: value for key, value in settings.items() if not key.startswith("estimator.")}
    return json.dumps(kept, sort_keys=True)


@lru_cache(maxsize=2)
def simulated(scene: str, settings: str) -> TrainingSets:
    """Return the three sets of a scene."""
    plan = training_plan(rig.load(scene, json.loads(settings)))
    return simulate_sets(plan, lambda done, total: None)

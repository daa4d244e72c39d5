"""One touch on a bent and twisted plate: nets of one step and of two (figure 5)."""

from collections.abc import Iterator

import numpy as np

import rig
from rig.report.figure import at_most
from rig.studies.paper.sets import Effort, Samples
from rig.studies.paper.table import Sample
from rig.training.bases import RATIOS, simulate_bases
from rig.training.descend import train_model
from rig.training.model_score import base_report
from rig.training.plan import training_plan


def deformable(effort: Effort) -> Samples:
    """One touch on a bent and twisted plate: a net of one step and one of two (figure 5)."""
    for scene, name, paper in (
        ("paper-deformable-one-step", "1 step, 64×4", 1.58),
        ("paper-deformable", "2 steps", 0.48),
    ):
        for ratio, sample in _by_load("deformable (5D)", scene, name, effort):
            learnt = ratio == 1.0  # it learnt no other load
            yield sample._replace(
                paper=f"{paper:g}" if learnt else "", bar=at_most(paper) if learnt else None
            )


def change(effort: Effort) -> Samples:
    """Two smooth steps, the second on the direction of what the touch changed of the strain."""
    of = (
        "deformable, best recipe",
        "paper-deformable-best",
        "2 steps on the direction of the change",
    )
    for ratio, sample in _by_load(*of, effort):
        yield sample._replace(paper="0.48" if ratio == 1.0 else "", bar=at_most(0.1))


def _by_load(system: str, scene: str, name: str, effort: Effort) -> Iterator[tuple[float, Sample]]:
    for seed in range(effort.seeds):
        epochs = effort.epochs(training_plan(rig.load(scene)).descent.epochs)
        overrides = {"estimator.seed": seed, "estimator.epochs": epochs}
        plan = training_plan(rig.load(scene, overrides))
        sets = simulate_bases(plan, lambda done, total: None)
        model = train_model(plan, sets)
        for ratio in RATIOS:
            test = sets.test.surface(ratio * sets.load)
            value = np.hypot(*(base_report(model, test)[:, :2] - test.xy).T).mean()
            what = f"{name}, load {ratio:g} Δ0: loss"
            yield ratio, Sample(system, what, "mm", "", epochs, seed, float(value))

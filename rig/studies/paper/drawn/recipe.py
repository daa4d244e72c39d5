"""One touch by the paper's recipe: what it leaves open, and what each choice changes.

The paper prints layers, activation, optimiser, loss and epochs. It does not print the learning
rate, the size of a batch, the rule of the first weights, whether outputs are scaled, or where the
gauges lie. Each row changes one of these and keeps the others.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from models import position_error
from rig.report.figure import Figure, at_least, at_most
from rig.studies.paper.drawn import plots
from rig.studies.paper.drawn.rows import seeds
from rig.studies.paper.drawn.trainings import Settings, train_kept

SEEDS = 5
TITLE = "One touch by the paper's recipe: what it leaves open"
CHOICES: dict[str, Settings] = {
    "as taken here": {},
    "learning rate 0.003": {"estimator.learning_rate": 3e-3},
    "learning rate 0.0003": {"estimator.learning_rate": 3e-4},
    "learning rate falls to 0": {"estimator.decay": "cosine"},
    "batches of 32, 30000 steps": {"estimator.batch": 32},
    "batches of 32, 100000 steps": {"estimator.batch": 32, "estimator.epochs": 100000},
    "first weights by He": {"estimator.start": "he"},
    "outputs scaled": {"estimator.outputs": "scaled"},
    "10000 epochs": {"estimator.epochs": 10000},
    "gauges 5 mm inside (reading A)": {"gauges.placement": "inside"},
}
"""What is changed of the scene paper-one."""

LONG = {"batches of 32, 100000 steps": 1}
"""Seeds of the choices that take longer."""


def recipe(folder: Path) -> Iterator[Figure]:
    """Fraction of 3000 random touches below 0.5 mm by each choice; the paper has more than 80 %."""
    drawn, axes = plots.canvas(1, width=7.0, height=4.2)
    rows: list[Figure] = []
    for number, (name, settings) in enumerate(CHOICES.items()):
        kept = [train_kept("paper-one", settings, seed) for seed in range(LONG.get(name, SEEDS))]
        errors = [position_error(*each.test()) for each in kept]
        below = [100 * float(np.mean(each < 0.5)) for each in errors]
        means = [float(each.mean()) for each in errors]
        largest = [float(each.max()) for each in errors]
        axes[0, 0].plot(below, np.full(len(below), number), "o", color="tab:blue", alpha=0.6)
        axes[0, 0].plot(np.median(below), number, "|", color="black", ms=18, mew=2)
        bar = at_least(80.0) if not settings else None
        paper = "> 80 %" if not settings else None
        shown = {"loss": (float(np.median(means)), "mm"), "max": (float(np.median(largest)), "mm")}
        rows += seeds(TITLE, f"{name}: below 0.5 mm", below, "%", paper, bar, **shown)
    axes[0, 0].axvline(80.0, **plots.PAPER, label="paper: more than 80 %")
    axes[0, 0].set_yticks(range(len(CHOICES)), list(CHOICES))
    axes[0, 0].invert_yaxis()
    axes[0, 0].set(xlabel="random touches below 0.5 mm, %")
    axes[0, 0].legend(loc="upper left", fontsize="small")
    yield plots.keep(drawn, folder, "paper-recipe.png", TITLE, "dots: seeds, bars: medians")
    yield from rows


CHANGED: dict[str, Settings] = {
    "as it is": {},
    "ReLU": {"estimator.activation": "relu"},
    "tanh": {"estimator.activation": "tanh"},
    "no asinh": {"estimator.inputs": "standard"},
    "no finish": {"estimator.lbfgs_steps": 0},
}
"""What is changed of the scene paper-one-best."""


def changed(folder: Path) -> Iterator[Figure]:
    """Give the best recipe, and the same less one of its parts each."""
    for name, settings in CHANGED.items():
        kept = [train_kept("paper-one-best", settings, seed) for seed in range(SEEDS)]
        losses = [float(position_error(*each.test()).mean()) for each in kept]
        spent = {"training": (float(np.median([each.cpu for each in kept])), "CPU s")}
        bar = None if settings else at_most(0.03)
        yield from seeds(
            "Best recipe of one touch, changed", f"{name}: loss", losses, "mm", None, bar, **spent
        )

"""How many gauges, touches and neurons: the paper's figures 3D and S1, and its table S1."""

import json
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np

from models import position_error, tune_net
from rig.report.figure import Figure, at_most
from rig.studies.paper.drawn import plots
from rig.studies.paper.drawn.extrapolation import forecast
from rig.studies.paper.drawn.one import SPAN
from rig.studies.paper.drawn.rows import seeds
from rig.studies.paper.drawn.trainings import FOLDER, KeptTraining, Settings, train_kept
from rig.studies.study import line
from rig.system.arrays import F64
from rig.training.model_score import predictor

APART = (10, 5, 2)  # mm, of gauges and of training touches
EPOCHS = 1000  # of the paper's 30000, where nine pairs of spacings are compared
SEEDS = 5
SCENE = "paper-one"
SEARCHED = 500  # epochs of each net of the search, a sixtieth of the paper's
PAPER_EPOCHS = 30000  # of its first model; it prints none of this one
TRIALS = 50
FINEST = {"gauges.spacing": "1 mm", "training.spacing": "1 mm"}
FINEST_BEST = "paper-one-finest"
FINEST_PAPER: Settings = FINEST
"""Spacing 1/1 by the recipe of the paper's first model: all touches a step, 30000 steps."""

BATCHES: Settings = FINEST | {"estimator.batch": 32, "estimator.epochs": 60000}
"""The same in the batches of 32 that the paper's library takes when not asked."""

WHOLE_SET: Settings = FINEST | {"estimator.epochs": 7500}
LEFT_OPEN: dict[str, Settings] = {
    "batches of 32, 60000 steps": BATCHES,
    "batches of 32, rate falls to 0": BATCHES | {"estimator.decay": "cosine"},
    "batches of 32, learning rate 0.0003": BATCHES | {"estimator.learning_rate": 3e-4},
    "all touches a step, 30000 steps": FINEST_PAPER,
    "all touches a step, 7500 steps": WHOLE_SET,
    "all touches a step, rate falls to 0": WHOLE_SET | {"estimator.decay": "cosine"},
    "the same, first weights by He": WHOLE_SET
    | {"estimator.decay": "cosine", "estimator.start": "he"},
    "the same, gauges 5 mm inside (reading A)": WHOLE_SET
    | {"estimator.decay": "cosine", "gauges.placement": "inside"},
}
"""What the paper does not print of its spacing 1/1, one choice a row."""


def spacing(folder: Path) -> Iterator[Figure]:
    """Loss by the spacing of gauges and of training touches (3D)."""
    title = "Figure 3D: spacing of gauges (Ls) and of training touches (Lt)"
    drawn, axes = plots.canvas(1, width=5.2)
    rows: list[Figure] = []
    losses = {
        (gauges, touches): [
            _loss({"gauges.spacing": f"{gauges} mm", "training.spacing": f"{touches} mm"}, seed)
            for seed in range(SEEDS)
        ]
        for gauges, touches in product(APART, APART)
    }
    for gauges in APART:
        values = np.array([losses[gauges, touches] for touches in APART])
        middle = np.median(values, axis=1)
        (curve,) = axes[0, 0].plot(APART, middle, "o-", label=f"Ls {gauges} mm")
        spread = values.min(axis=1), values.max(axis=1)
        axes[0, 0].fill_between(APART, *spread, color=curve.get_color(), alpha=0.2)
        for touches in APART:
            paper = 0.38 if (gauges, touches) == (5, 5) else None
            said = f"Ls {gauges}, Lt {touches} mm, {EPOCHS} epochs: loss"
            rows += seeds(title, said, losses[gauges, touches], "mm", paper)
    best = [_error(FINEST_BEST, {}, seed) for seed in range(SEEDS)]
    paper_recipe = [_error(SCENE, FINEST_PAPER, seed) for seed in range(SEEDS)]
    axes[0, 0].plot(1, np.median(paper_recipe), "ks", label="Ls 1, paper's recipe")
    axes[0, 0].plot(1, np.median(best), "k*", ms=11, label="Ls 1, best recipe")
    axes[0, 0].plot([5, 1], [0.38, 0.06], "x", color="tab:red", ms=9, label="paper")
    axes[0, 0].set(xlabel="Lt, mm", ylabel="loss, mm", xscale="log", yscale="log")
    axes[0, 0].set_xticks([1, 2, 5, 10], ["1", "2", "5", "10"])
    axes[0, 0].legend(fontsize="x-small")
    yield plots.keep(drawn, folder, "paper-3d.png", title, f"{SEEDS} seeds, median and range")
    yield from rows
    yield from seeds(
        title, "Ls 1, Lt 1 mm, paper's recipe: loss", paper_recipe, "mm", 0.06, at_most(0.06)
    )
    yield from seeds(title, "Ls 1, Lt 1 mm, best recipe: loss", best, "mm", None, at_most(0.01))


def finest(folder: Path) -> Iterator[Figure]:
    """Loss at spacing 1/1 by what the paper does not print of its recipe, and by more steps."""
    title = "Spacing 1/1 by the paper's recipe: what it leaves open"
    drawn, axes = plots.canvas(1, width=9.4, height=4.2)
    rows: list[Figure] = []
    for number, (name, settings) in enumerate(LEFT_OPEN.items()):
        kept = train_kept(SCENE, settings)
        curve, colour = kept.curves()[""], f"C{number}"
        plots.losses(axes[0, 0], [curve], colour, name)
        loss = float(position_error(*kept.test()).mean())
        said = f"Ls 1, Lt 1 mm, {name}: loss"
        spent = {"training": (kept.cpu, "CPU s")}
        rows += seeds(title, said, [loss], "mm", 0.06, None, **spent)
        if kept.plan.descent.decay == "constant":
            rows += _extrapolated(title, name, curve, steps_of_the_paper(kept))
    axes[0, 0].axhline(0.06, **plots.PAPER, label="paper: 0.06 mm")
    axes[0, 0].legend(fontsize="x-small", loc="upper left", bbox_to_anchor=(1.02, 1.0))
    yield plots.keep(drawn, folder, "paper-3d-recipe.png", title, "losses on the way, one seed")
    yield from rows


def steps_of_the_paper(kept: KeptTraining) -> float:
    """Return the steps in the 30000 epochs of the paper's first model."""
    batch = kept.plan.descent.batch
    return PAPER_EPOCHS * (np.ceil(len(kept.flat.training) / batch) if batch else 1)


def _extrapolated(title: str, name: str, curve: F64, steps: float) -> Iterator[Figure]:
    thin = plots.thinned(curve[1:])
    ahead = forecast(thin[:, 0], thin[:, 2], np.array([steps]), np.random.default_rng(0))
    end = {"here": ahead.middle, "least": ahead.low, "largest": ahead.high}
    said = f"Ls 1, Lt 1 mm, {name}, extrapolated to {PAPER_EPOCHS} epochs: loss"
    yield from line(title, said, **{key: (float(value[0]), "mm") for key, value in end.items()})


def _loss(spread: Settings, seed: int) -> float:
    return _error(SCENE, {**spread, "estimator.epochs": EPOCHS}, seed)


def _error(scene: str, settings: Settings, seed: int) -> float:
    return float(position_error(*train_kept(scene, settings, seed).test()).mean())


def search(folder: Path) -> Iterator[Figure]:
    """Fifty nets of random layers, and the local losses of the first nine (S1, table S1)."""
    title = "Table S1 and figure S1: search for a net"
    ranked = _ranked()
    drawn, axes = plots.canvas(3, 3, 3.6, 3.1)
    largest: list[float] = []
    for place, (layers, _) in enumerate(ranked[:9]):
        xy, error = _local(layers)
        largest.append(float(error.max()))
        named = f"{place + 1}: {' × '.join(map(str, layers))}, mean {error.mean():.2f}"
        plots.plate_map(axes[place // 3, place % 3], xy, error, named, SPAN)
    yield plots.keep(drawn, folder, "paper-s1.png", title, "the first nine of fifty")
    losses = [loss for _, loss in ranked]
    for what, value, paper in (
        ("best of 50: validation loss", losses[0], 0.24),
        ("median of 50: validation loss", float(np.median(losses)), 0.30),
        ("worst of 50: validation loss", losses[-1], 1.38),
    ):
        yield from line(title, what, here=(value, "mm", None, TRIALS), paper=(paper, "mm"))
    for rank, (layers, loss) in enumerate(ranked[:10], 1):
        shown = {"layers": " × ".join(map(str, layers))}
        if rank <= len(largest):
            shown |= {"largest local loss": (largest[rank - 1], "mm")}
        yield from line(title, f"rank {rank}", here=(loss, "mm", None, 1), **shown)


def _local(layers: tuple[int, ...]) -> tuple[F64, F64]:
    """Places watched, and the error there."""
    kept = train_kept(SCENE, _searched(layers))
    watched = kept.flat.validation
    return watched.targets, position_error(watched.targets, predictor(kept.model)(watched.strain))


def _searched(layers: tuple[int, ...]) -> Settings:
    return {"estimator.layers": list(layers), "estimator.epochs": SEARCHED}


def _ranked() -> list[tuple[tuple[int, ...], float]]:
    """Return the nets of the search and their validation losses, best first; kept in a file."""
    path = FOLDER / f"search-{TRIALS}-{SEARCHED}.json"
    if not path.is_file():
        found = tune_net(lambda layers: float(_local(layers)[1].mean()), TRIALS)
        path.write_text(json.dumps([(each.layers, each.loss) for each in found]))
    return [(tuple(layers), loss) for layers, loss in json.loads(path.read_text())]

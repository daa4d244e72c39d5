"""The paper's figures of one touch: 2D, 3A, 3B, S2, S4, and the other nets of section 2.1."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from models import position_error
from rig.report.figure import Figure, at_least
from rig.studies.paper.drawn import plots
from rig.studies.paper.drawn.rows import beside, seeds, solved
from rig.studies.paper.drawn.trainings import KeptTraining, train_kept
from rig.studies.study import line
from rig.system.arrays import F64
from rig.training.model_score import predictor

SEEDS = 5
SPAN = 0.02, 5.0  # mm, of the colours of every map of one touch
LOADS, LEVELS = (1, 2, 5, 10), (0.0, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1)


def training(folder: Path) -> Iterator[Figure]:
    """Losses on the way, and the error at each of the 196 places that were watched (2D)."""
    title = "Figure 2D: one touch, losses and local losses"
    kept = trained_one()
    local = [_local(each) for each in kept]
    middle = _median(kept)
    drawn, axes = plots.canvas(2)
    plots.losses(axes[0, 0], _curves(kept), "tab:blue", "2×32")
    axes[0, 0].axhline(0.3, **plots.PAPER, label="paper: below 0.3 mm at the end")
    axes[0, 0].legend(fontsize="x-small")
    watched = kept[middle].flat.validation.targets
    plots.plate_map(axes[0, 1], watched, local[middle], "196 places watched", SPAN)
    yield plots.keep(drawn, folder, "paper-2d.png", title, f"seeds 0 to {SEEDS - 1}")
    learnt = [float(position_error(*_pair(each, "training")).mean()) for each in kept]
    yield from seeds(title, "training loss", learnt, "mm", "< 0.3 mm", None, **beside(kept[0]))
    yield from seeds(
        title, "validation loss", [float(each.mean()) for each in local], "mm", "< 0.3 mm"
    )
    yield from seeds(title, "largest local loss", [float(e.max()) for e in local], "mm", 0.78)
    yield from seeds(title, "smallest local loss", [float(e.min()) for e in local], "mm", 0.01)


def random_touches(folder: Path) -> Iterator[Figure]:
    """Draw a hundred touches, true and predicted, and the errors of 3000 (3A, 3B)."""
    title = "Figures 3A and 3B: random touches"
    kept, best = trained_one(), [train_kept("paper-one-best", {}, seed) for seed in range(SEEDS)]
    errors, smaller = ([_tested(each) for each in group] for group in (kept, best))
    drawn, axes = plots.canvas(3)
    true, found = kept[_median(kept)].test()
    plots.places(axes[0, 0], true[:100], found[:100], "3A: 100 random touches, paper's recipe")
    plots.histogram(axes[0, 1], errors, "3B: 3000 random touches, paper's recipe", 1.0)
    plots.histogram(axes[0, 2], smaller, "the same, best recipe")
    yield plots.keep(drawn, folder, "paper-3ab.png", title, "paper's recipe and the best one")
    for name, group, papers in (
        ("paper's recipe", errors, ("0.38 mm", "> 80 %", "100 %", "< 1 mm")),
        ("best recipe", smaller, (None,) * 4),
    ):
        yield from _distribution(title, name, group, papers)
    yield from line(title, "solver, the same strains", here=beside(kept[0])["solver"])


def _distribution(
    title: str, name: str, errors: list[F64], papers: tuple[str | None, ...]
) -> Iterator[Figure]:
    """Rows of the mean, the fractions below 0.5 and 1 mm, and the largest error."""
    below, all_below = ([100 * float(np.mean(e < limit)) for e in errors] for limit in (0.5, 1.0))
    bar = at_least(80.0) if papers[0] else None
    largest = [float(each.max()) for each in errors]
    yield from seeds(title, f"{name}: loss", [float(e.mean()) for e in errors], "mm", papers[0])
    yield from seeds(title, f"{name}: below 0.5 mm", below, "%", papers[1], bar)
    yield from seeds(title, f"{name}: below 1 mm", all_below, "%", papers[2])
    yield from seeds(title, f"{name}: largest", largest, "mm", papers[3])


def regressions(folder: Path) -> Iterator[Figure]:
    """Linear and quadratic regression over the plate, training and validation (S2)."""
    title = "Figure S2: regressions"
    drawn, axes = plots.canvas(2, 2)
    for row, fit in zip(axes, ("linear", "quadratic"), strict=True):
        kept = train_kept("paper-regression", {"estimator.fit": fit})
        for panel, name in zip(row, ("training", "validation"), strict=True):
            true, found = _pair(kept, name)
            plots.plate_map(panel, true, _floor(true, found), f"{fit}, {name}", (1e-4, 50.0))
    yield plots.keep(drawn, folder, "paper-s2.png", title, "linear above, quadratic below")
    for fit, paper in (
        ("linear", "fails at the edge"),
        ("quadratic", "fails at the edge"),
        ("ridge", None),
        ("gaussian-process", None),
        ("nearest", None),
    ):
        kept = train_kept("paper-regression", {"estimator.fit": fit})
        for name in ("training", "validation", "test"):
            error = position_error(*_pair(kept, name))
            said = f"{fit}: {name}"
            shown = {"largest": (float(error.max()), "mm"), "paper": paper or ""}
            yield from line(title, said, here=(float(error.mean()), "mm", None, 1), **shown)


def other_nets(folder: Path) -> Iterator[Figure]:
    """Compare the convolutional and the adversarial net with the sequential one (section 2.1)."""
    title = "Section 2.1: three kinds of net"
    drawn, axes = plots.canvas(1)
    rows: list[Figure] = []
    for name, scene, colour, paper in (
        ("sequential", "paper-one", "tab:blue", "chosen"),
        ("convolutional", "paper-cnn", "tab:orange", "worse"),
        ("adversarial", "paper-gan", "tab:green", "worse"),
    ):
        kept = [train_kept(scene, {}, seed) for seed in range(SEEDS)]
        plots.losses(axes[0, 0], _curves(kept), colour, name)
        values = [float(_tested(each).mean()) for each in kept]
        spent = float(np.median([each.cpu for each in kept])), "CPU s"
        rows += seeds(title, f"{name}: loss", values, "mm", paper, training=spent)
    axes[0, 0].legend(fontsize="x-small")
    yield plots.keep(drawn, folder, "paper-nets.png", title, "losses of all seeds")
    yield from rows


def noise(folder: Path) -> Iterator[Figure]:
    """Loss against measurement error for loads of several sizes (S4), with solver and bound."""
    title = "Figure S4: measurement error"
    kept = trained_one()
    test, rng = kept[0].flat.test, np.random.default_rng(4)
    unit = float(np.sqrt(np.mean(kept[0].flat.training.strain ** 2)))
    draws = rng.normal(size=test.strain.shape)
    bound = solved(kept[0].plan, test)[1]
    drawn, axes = plots.canvas(1, width=5.2)
    rows: list[Figure] = []
    for load in LOADS:
        losses = np.array(
            [
                [
                    position_error(
                        test.targets,
                        predictor(each.model)(test.strain + level * unit * draws / load),
                    ).mean()
                    for level in LEVELS
                ]
                for each in kept
            ]
        )
        middle = np.median(losses, axis=0)
        (curve,) = axes[0, 0].plot(
            [100 * each for each in LEVELS], middle, "o-", label=f"load {load} Δ0"
        )
        spread = losses.min(axis=0), losses.max(axis=0)
        axes[0, 0].fill_between(
            [100 * e for e in LEVELS], *spread, color=curve.get_color(), alpha=0.2
        )
        for level, values in zip(LEVELS, losses.T, strict=True):
            said = f"load {load} Δ0, error {100 * level:g} % of the strain of load 1: loss"
            paper = 0.38 if level == 0 else None
            crb = bound * 100 * level / load, "mm"
            rows += seeds(title, said, values.tolist(), "mm", paper, bound=crb)
    axes[0, 0].axhline(0.38, **plots.PAPER, label="paper at no error: 0.38 mm")
    axes[0, 0].set(xlabel="error, % of the strain of load 1", ylabel="loss, mm", yscale="log")
    axes[0, 0].set_yticks([0.3, 0.5, 1, 2], ["0.3", "0.5", "1", "2"])
    axes[0, 0].minorticks_off()
    axes[0, 0].legend(fontsize="small")
    yield plots.keep(drawn, folder, "paper-s4.png", title, f"{SEEDS} seeds, median and range")
    yield from rows


def trained_one() -> list[KeptTraining]:
    """Return the paper's first model, of all seeds."""
    return [train_kept("paper-one", {}, seed) for seed in range(SEEDS)]


def _curves(kept: list[KeptTraining]) -> list[F64]:
    return [each.curves()[""] for each in kept]


def _pair(kept: KeptTraining, name: str) -> tuple[F64, F64]:
    """Return true and predicted places of a set."""
    data = kept.flat.named()[name]
    return data.targets, np.asarray(predictor(kept.model)(data.strain))


def _local(kept: KeptTraining) -> F64:
    return position_error(*_pair(kept, "validation"))


def _tested(kept: KeptTraining) -> F64:
    return position_error(*kept.test())


def _floor(true: F64, found: F64) -> F64:
    """Errors, none of them 0, for colours that are logarithmic."""
    return np.maximum(position_error(true, found), 1e-9)


def _median(kept: list[KeptTraining]) -> int:
    """Return which seed has the median loss of the test."""
    means = [_tested(each).mean() for each in kept]
    return int(np.argsort(means)[len(means) // 2])

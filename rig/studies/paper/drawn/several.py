"""The paper's figures of several equal touches: 4A, 4B, S5, S6, S7."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from models import matched_error
from rig.report.figure import Bar, Figure, at_most
from rig.studies.paper.drawn import plots
from rig.studies.paper.drawn.extrapolation import Forecast, forecast, held_out
from rig.studies.paper.drawn.rows import beside, seeds
from rig.studies.paper.drawn.trainings import KeptTraining, train_kept
from rig.studies.study import Cell, line
from rig.system.arrays import F64

SIZES = {"2×32": (32,) * 2, "4×64": (64,) * 4}
"""Layers of the smaller nets."""

SMALLER, SEEDS = 3000, 5
"""Steps and seeds of these; as many seeds has the best recipe."""

WIDE, STEPS, WHOLE = (256,) * 8, 4000, 60000
"""The paper's net of three touches: layers, steps of a look, and those of `--full`: 17 ms each
on one core, 3 ms on a GPU."""

WIDE_SEEDS = 3
"""Of that net."""

PAIR = 1000
"""Steps of the same net with two touches."""

BUDGET = 70 * 3600 / 0.01
"""Steps of 512 samples that 70 hours of the paper's GPU may have taken, at 10 ms each: its own
number of steps is not printed."""

PAPER, COLOURS = 0.43, ("tab:blue", "tab:orange", "tab:green")
BEST = {2: "paper-two-best", 3: "paper-three-best"}
SCENES = {2: "paper-two", 3: "paper-three"}
AHEAD = np.geomspace(1e3, BUDGET, 40)


def sized(touches: int, layers: tuple[int, ...], steps: int, seed: int) -> KeptTraining:
    """Return a training by the paper's recipe: Adam at a constant rate."""
    settings = {
        "estimator.layers": list(layers),
        "estimator.epochs": steps,
        "estimator.decay": "constant",
    }
    return train_kept(SCENES[touches], settings, seed)


def errors(kept: KeptTraining) -> tuple[F64, F64]:
    """Errors of the test: of columns as they are sorted, and of paired touches, (N, k) mm."""
    true, found = (
        each[:, : 2 * kept.plan.touches].reshape(-1, kept.plan.touches, 2) for each in kept.test()
    )
    return np.linalg.norm(found - true, axis=2), matched_error(true, found)[0]


def two(folder: Path) -> Iterator[Figure]:
    """Losses of two touches by size of the net (S5)."""
    yield from _equal(folder, 2, "Figure S5: two touches", "paper-s5.png", PAIR, WIDE_SEEDS)


def three(folder: Path) -> Iterator[Figure]:
    """Losses of three touches by size of the net, extrapolated to the paper's (4A)."""
    yield from _equal(folder, 3, "Figure 4A: three touches", "paper-4a.png", STEPS, WIDE_SEEDS)


def three_whole(folder: Path) -> Iterator[Figure]:
    """Do the same with the steps of a night; it goes on where it was killed."""
    yield from _equal(folder, 3, "Figure 4A: three touches", "paper-4a.png", WHOLE, WIDE_SEEDS)


def _equal(
    folder: Path, touches: int, title: str, file: str, steps: int, number: int
) -> Iterator[Figure]:
    drawn, axes = plots.canvas(1, width=5.6, height=4.2)
    rows: list[Figure] = []
    curves: dict[str, list[F64]] = {}
    solver = beside(sized(touches, WIDE, steps, 0))  # the test of all these is the same
    for (name, layers), colour in zip(SIZES.items(), COLOURS, strict=False):
        kept = [sized(touches, layers, SMALLER, seed) for seed in range(SEEDS)]
        curves[name] = [each.curves()[""] for each in kept]
        plots.losses(axes[0, 0], curves[name], colour, name)
        rows += _rows(title, f"{name}, {SMALLER} steps", kept, solver, None)
    wide = [sized(touches, WIDE, steps, seed) for seed in range(number)]
    curves["8×256"] = [each.curves()[""] for each in wide]
    plots.losses(axes[0, 0], curves["8×256"], COLOURS[2], "8×256")
    three = touches == 3
    rows += _rows(title, f"8×256, {steps} steps", wide, solver, PAPER if three else None)
    first = curves["8×256"][0]
    ahead, said = extrapolated(title, "8×256", first, PAPER if three else None)
    axes[0, 0].fill_between(ahead.steps, ahead.low, ahead.high, color=COLOURS[2], alpha=0.15)
    axes[0, 0].plot(ahead.steps, ahead.middle, ":", color=COLOURS[2], label="8×256, extrapolated")
    if three:
        axes[0, 0].axhline(PAPER, **plots.PAPER, label="paper, 8×256 after 70 h: 0.43 mm")
    axes[0, 0].set(ylim=(0.05, 60))
    axes[0, 0].legend(fontsize="x-small")
    best = [train_kept(BEST[touches], {}, seed) for seed in range(SEEDS)]
    rows += _rows(title, "best recipe", best, solver, PAPER if three else None, at_most(PAPER))
    plots.keep_losses(folder, file.replace(".png", "-losses.csv"), curves)
    yield plots.keep(drawn, folder, file, title, "all seeds, and the extrapolation of the widest")
    yield from rows
    yield from said


def _rows(
    title: str,
    name: str,
    kept: list[KeptTraining],
    solver: Mapping[str, Cell],
    paper: float | None,
    bar: Bar | None = None,
) -> list[Figure]:
    both = [errors(each) for each in kept]
    asked = at_most(1.2 * PAPER) if paper and bar is None else None
    first = [float(each.mean()) for each, _ in both]
    paired = [float(each.mean()) for _, each in both]
    means: list[F64] = [np.asarray(each.mean(axis=1)) for _, each in both]
    below = [100 * float(np.mean(each < 0.8)) for each in means]
    return [
        *seeds(title, f"{name}: loss", first, "mm", paper, asked, **solver, **spent(kept)),
        *seeds(
            title, f"{name}: loss of paired touches", paired, "mm", paper, bar if paper else None
        ),
        *seeds(title, f"{name}: below 0.8 mm", below, "%", "100 %" if paper else None),
    ]


def spent(kept: list[KeptTraining]) -> dict[str, Cell]:
    """Give the median time of some trainings as a cell; none of the paper's largest net.

    That goes on from run to run, or is trained on a GPU: its time is not known in one piece.
    """
    if tuple(kept[0].plan.descent.layers) == WIDE:
        return {}
    return {"training": (float(np.median([each.cpu for each in kept])), "CPU s")}


def extrapolated(
    title: str, name: str, curve: F64, paper: float | None
) -> tuple[Forecast, list[Figure]]:
    """Extrapolate a validation curve (checks, 3); return the forecast, and what is said of it."""
    thin = plots.thinned(curve[1:])
    steps, loss, rng = thin[:, 0], thin[:, 2], np.random.default_rng(0)
    ahead = forecast(steps, loss, AHEAD[steps[-1] < AHEAD], rng)
    _, off, inside = held_out(steps, loss, 1 / 3, rng)
    end, limits = float(ahead.middle[-1]), (float(ahead.low[-1]), float(ahead.high[-1]))
    said = f"{name}, extrapolated to {BUDGET:.3g} steps: loss"
    shown = {"least": (limits[0], "mm"), "largest": (limits[1], "mm")}
    cells = shown | ({"paper": (paper, "mm")} if paper else {})
    rows = list(line(title, said, here=(end, "mm", None, 1), **cells))
    held = f"{name}, extrapolated from a third of the steps to all: error of the loss"
    rows += line(title, held, here=(100 * off, "%", None, 1), inside="yes" if inside else "no")
    if paper:
        middle, early = (_crossing(ahead.steps, each, paper) for each in (ahead.middle, ahead.low))
        said = f"{name}: steps to the paper's {paper:g} mm, extrapolated"
        rows += line(title, said, here=middle, least=early)
    return ahead, rows


def _crossing(steps: F64, loss: F64, limit: float) -> str:
    """Say after how many steps a curve falls below a limit."""
    below = np.flatnonzero(loss <= limit)
    return f"{steps[below[0]]:.2g}" if len(below) else f"more than {steps[-1]:.2g}"


def samples(folder: Path) -> Iterator[Figure]:
    """Errors of a hundred samples of three touches, and which of the three is worst (4B)."""
    title = "Figure 4B: a hundred samples of three touches"
    drawn, axes = plots.canvas(2, 1, 5.6)
    sums: dict[str, F64] = {}
    for panel, (name, kept) in zip(axes[0], _recipes(3, STEPS).items(), strict=True):
        paired = [errors(each)[1][:100] for each in kept]
        for point in range(3):
            panel.plot(paired[0][:, point], ".", ms=4, label=f"touch {point + 1}")
        panel.axhline(0.8, **plots.PAPER, label="paper: all below 0.8 mm")
        panel.set(title=name, xlabel="sample", ylabel="error, mm", yscale="log")
        panel.legend(fontsize="x-small", loc="lower right")
        sums[name] = np.sum(paired, axis=1)
    yield plots.keep(drawn, folder, "paper-4b.png", title, "each touch of each sample, seed 0")
    for name, totals in sums.items():
        for point, values in enumerate(totals.T, 1):
            yield from seeds(
                title, f"{name}: sum of 100 errors, touch {point}", values.tolist(), "mm"
            )
        ratios = (totals.max(axis=1) / totals.min(axis=1)).tolist()
        paper = "almost the same" if name == "paper's recipe" else None
        yield from seeds(title, f"{name}: largest sum over smallest", ratios, "", paper)


def _recipes(touches: int, steps: int) -> dict[str, list[KeptTraining]]:
    """Return the nets of the paper's recipe, and of the best one."""
    return {
        "paper's recipe": [sized(touches, WIDE, steps, seed) for seed in range(WIDE_SEEDS)],
        "best recipe": [train_kept(BEST[touches], {}, seed) for seed in range(SEEDS)],
    }


def histograms(folder: Path) -> Iterator[Figure]:
    """Errors of each touch of two and of three (S7)."""
    title = "Figure S7: errors of each touch"
    drawn, axes = plots.canvas(3, 2, 3.9, 3.0)
    axes[0, 2].set_axis_off()
    for row, touches in zip(axes, (2, 3), strict=True):
        for name, kept in _recipes(touches, PAIR if touches == 2 else STEPS).items():
            paired = np.array([errors(each)[1].T for each in kept])  # (seeds, touches, samples)
            for panel, error in zip(row, paired[0], strict=False):
                edges = np.geomspace(0.003, 30, 41)
                weights = np.full(len(error), 100 / len(error))
                panel.hist(np.clip(error, 0.003, 30), edges, weights=weights, alpha=0.6, label=name)
            for point, by_seed in enumerate(paired.swapaxes(0, 1), 1):
                said = f"{touches} touches, {name}: touch {point}"
                median, high = (
                    float(each) for each in np.median(np.percentile(by_seed, (50, 95), axis=1), 1)
                )
                shown: dict[str, Cell] = {"median": (median, "mm"), "95 %": (high, "mm")}
                means = by_seed.mean(axis=1).tolist()
                yield from seeds(title, f"{said}, mean", means, "mm", None, None, **shown)
        for point, panel in enumerate(row[:touches], 1):
            panel.set(title=f"{touches} touches: touch {point}", xscale="log")
            panel.set(xlabel="error, mm", ylabel="fraction, %")
            panel.legend(fontsize="x-small")
    yield plots.keep(drawn, folder, "paper-s7.png", title, "2000 random samples each, seed 0")


def doubled(folder: Path) -> Iterator[Figure]:
    """Two touches, each sample written both ways round: training fails (S6)."""
    title = "Figure S6: each sample both ways round"
    drawn, axes = plots.canvas(1, width=5.2)
    rows: list[Figure] = []
    orders = {"sorted": "canonical", "doubled": "doubled"}
    for (name, order), colour in zip(orders.items(), COLOURS, strict=False):
        settings = {"dataset.order": order, "estimator.epochs": 2000}
        kept = [train_kept("paper-two", settings, seed) for seed in range(SEEDS)]
        plots.losses(axes[0, 0], [each.curves()[""] for each in kept], colour, name)
        values = [float(errors(each)[0].mean()) for each in kept]
        rows += seeds(title, f"4×64, {name} samples: loss", values, "mm", "fails" if rows else None)
    axes[0, 0].legend(fontsize="x-small")
    yield plots.keep(drawn, folder, "paper-s6.png", title, f"{SEEDS} seeds each")
    yield from rows

"""Draw the paper's figures anew: from the figures kept, and from a net trained on one touch.

Usage: ``python -m rig.studies.paper.drawings FOLDER [MODEL]``; ``touchplate train`` writes MODEL
(results/paper-one/model.h5), without which figures 2D, 3A and 3B are left out.
"""

# matplotlib leaves the types of its keywords open.
# pyright: reportUnknownMemberType=false

import re
import sys
from collections import defaultdict
from pathlib import Path

import matplotlib as mpl
import numpy as np

from models import position_error, predict
from rig.studies.paper.table import final, read_curves

mpl.use("Agg")
from matplotlib import pyplot as plt

import rig
from models.nets import store
from rig.studies.study import part
from rig.training.data import simulate_sets
from rig.training.plan import training_plan

CURVES = {
    "3D": ("spacing (3D)", r"Ls (?P<line>\d+), Lt (?P<x>\d+)", "Ls {} mm", "Lt, mm"),
    "S4": (
        "measurement error (S4)",
        r"load (?P<line>\d+), error (?P<x>\d+)",
        "load {} Δ0",
        "error, % of the strain of load 1",
    ),
    "5D": (
        "deformable",
        r"(?P<line>\d steps?( on the change)?).*load (?P<x>[\d.]+)",
        "{}",
        "load, Δ0",
    ),
}
"""Of each figure: how its systems begin, where line and abscissa stand, legend and axis."""

COLOURS = "tab:blue", "tab:orange", "tab:green"


def curves(folder: Path) -> None:
    """Draw the figures that are curves of a loss."""
    for name, (system, pattern, legend, axis) in CURVES.items():
        lines: defaultdict[str, dict[float, float]] = defaultdict(dict)
        for (begun, what), figures in final().items():
            if begun.startswith(system) and (found := re.search(pattern, what)):
                values = [figure.value for figure in figures]
                lines[found["line"]][float(found["x"])] = float(np.median(values))
        if not lines:
            continue
        figure, axes = plt.subplots(figsize=(5, 4), layout="constrained")
        for line, points in lines.items():
            x = sorted(points)
            axes.plot(x, [points[each] for each in x], "o-", label=legend.format(line))
        axes.set(xlabel=axis, ylabel="loss, mm", yscale="log", title=f"figure {name}")
        axes.legend()
        figure.savefig(folder / f"figure-{name}.png", dpi=120)


def training(folder: Path) -> None:
    """Draw how the losses of three touches fell (figure 4A), from the curves kept."""
    lines: defaultdict[str, list[tuple[float, float, float]]] = defaultdict(list)
    for row in read_curves():
        lines[row.line].append((row.epoch, row.training, row.validation))
    figure, axes = plt.subplots(figsize=(5, 4), layout="constrained")
    for (line, points), colour in zip(lines.items(), COLOURS, strict=False):
        epoch, *losses = np.transpose(points)
        for loss, style, name in zip(losses, ("--", "-"), ("training", "validation"), strict=True):
            axes.plot(epoch, loss, style, color=colour, label=f"{line}, {name}")
    axes.set(xlabel="epoch", ylabel="loss, mm", xscale="log", yscale="log", title="figure 4A")
    axes.legend(fontsize="small")
    figure.savefig(folder / "figure-4A.png", dpi=120)


def magnitudes(folder: Path) -> None:
    """Draw how places and magnitudes share the loss by its weight k (figure 4C)."""
    found: defaultdict[str, dict[float, float]] = defaultdict(dict)
    for (system, case), figures in final().items():
        if system == "two magnitudes (4C)":
            named = part(re.search(r"k ([\d.]+): (\w+)", case))
            found[named[2]][float(named[1])] = float(
                np.median([figure.value for figure in figures])
            )
    figure, axes = plt.subplots(figsize=(5, 4), layout="constrained")
    for what, unit in (("position", "mm"), ("magnitude", "Δ0")):
        weights = sorted(found[what])
        axes.plot(weights, [found[what][each] for each in weights], "o-", label=f"{what}, {unit}")
    axes.set(xlabel="k", ylabel="error", xscale="log", title="figure 4C")
    axes.legend()
    figure.savefig(folder / "figure-4C.png", dpi=120)


def of_net(folder: Path, path: Path) -> None:
    """Draw the training, the places and the histogram of one net."""
    trained, about = store.load_net(path)
    sets = simulate_sets(
        training_plan(rig.scene.Scene.model_validate(about["scene"])), lambda done, total: None
    )
    found = predict(trained.net, sets.test.strain)
    local = position_error(sets.validation.targets, predict(trained.net, sets.validation.strain))
    figure, axes = plt.subplots(2, 2, figsize=(9, 8), layout="constrained")
    axes[0, 0].loglog(trained.history, label=["training", "validation"])
    axes[0, 0].set(xlabel="epoch", ylabel="loss, mm", title="2D: training")
    axes[0, 0].legend()
    x, y = sets.validation.targets.T
    shown = axes[0, 1].scatter(x, y, c=local, s=60, marker="s")
    figure.colorbar(shown, ax=axes[0, 1], label="mm")
    axes[0, 1].set(xlabel="x, mm", ylabel="y, mm", title="2D: local validation loss", aspect=1)
    axes[1, 0].plot(*sets.test.targets[:100].T, "ro", fillstyle="none", label="true")
    axes[1, 0].plot(*found[:100].T, "b.", label="predicted")
    axes[1, 0].set(xlabel="x, mm", ylabel="y, mm", title="3A: 100 random touches", aspect=1)
    axes[1, 0].legend()
    axes[1, 1].hist(position_error(sets.test.targets, found), bins=60)
    axes[1, 1].set(xlabel="loss, mm", ylabel="touches", title="3B: 3000 random touches")
    figure.savefig(folder / "figures-2D-3A-3B.png", dpi=120)


def main(folder: str, model: str | None = None) -> None:
    """Write the plots to a folder."""
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    curves(place)
    training(place)
    magnitudes(place)
    if model:
        of_net(place, Path(model))
    print(*sorted(place.glob("figure*.png")), sep="\n")


if __name__ == "__main__":
    main(*sys.argv[1:])

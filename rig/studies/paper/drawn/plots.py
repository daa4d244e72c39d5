"""How the paper's figures are drawn: maps, arrows, histograms, curves, in one style."""

# matplotlib leaves the types of its keywords open.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

import csv
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure as Canvas

from rig.report.figure import Figure, drawing
from rig.system.arrays import F64

PAPER = {"color": "0.35", "linestyle": ":", "linewidth": 1.4}
"""How the paper's own number is drawn."""

DOTS_PER_INCH = 110


def canvas(columns: int, rows: int = 1, width: float = 4.2, height: float = 3.6) -> tuple[Any, Any]:
    """Return a canvas and its axes, (rows, columns)."""
    drawn = Canvas(figsize=(width * columns, height * rows), layout="constrained")
    return drawn, drawn.subplots(rows, columns, squeeze=False)


def keep(drawn: Any, folder: Path, file: str, table: str, case: str) -> Figure:
    """Write a canvas into the folder of plots; return the line that shows it."""
    drawn.savefig(folder / file, dpi=DOTS_PER_INCH)
    return drawing(table, case, file)


def plate_map(axes: Any, xy: F64, error: F64, title: str, span: tuple[float, float]) -> None:
    """Draw the error at places of a plate; colours are logarithmic between the ends of `span`."""
    low, high = span
    shown = axes.scatter(
        *xy.T,
        c=np.clip(error, low, high),
        s=26,
        marker="s",
        norm=LogNorm(low, high),
        cmap="magma_r",
    )
    worst = int(np.argmax(error))
    axes.plot(*xy[worst], "o", ms=11, mfc="none", mec="tab:blue", mew=1.5)
    axes.set(title=f"{title}\nlargest {error[worst]:.2g} mm", xlabel="x, mm", ylabel="y, mm")
    axes.set(aspect="equal", xlim=(0, 100), ylim=(0, 100))
    axes.figure.colorbar(shown, ax=axes, label="error, mm", extend="both", shrink=0.85)


def places(axes: Any, true: F64, found: F64, title: str) -> None:
    """Draw true and predicted places (N, 2)."""
    axes.plot(*true.T, "o", ms=6, mfc="none", mec="tab:red", label="true")
    axes.plot(*found.T, ".", ms=3.5, color="tab:blue", label="predicted")
    axes.set(title=title, xlabel="x, mm", ylabel="y, mm", aspect="equal")
    axes.set(xlim=(0, 100), ylim=(0, 100))
    axes.legend(loc="lower center", ncols=2, fontsize="x-small", framealpha=0.9)


def histogram(axes: Any, errors: Sequence[F64], title: str, paper: float | None = None) -> None:
    """Draw the errors of each seed as steps, in parts of all touches."""
    top = float(np.quantile(np.concatenate(list(errors)), 0.998))
    edges = np.linspace(0.0, top, 41)
    for seed, error in enumerate(errors):
        weights = np.full(len(error), 100.0 / len(error))
        axes.hist(
            np.clip(error, None, top), edges, weights=weights, histtype="step", label=f"seed {seed}"
        )
    if paper is not None:
        axes.axvline(paper, **PAPER, label=f"paper: all below {paper:g} mm")
    axes.set(title=title, xlabel="error, mm", ylabel="fraction of touches, %")
    axes.legend(fontsize="x-small")


def losses(axes: Any, curves: Sequence[F64], colour: str, label: str) -> None:
    """Draw the curves (checks, 3) of some seeds: training dashed, validation solid."""
    for number, curve in enumerate(curves):
        epochs, training, validation = thinned(curve).T
        named = {"label": f"{label}, validation"} if number == 0 else {}
        axes.loglog(epochs, validation, color=colour, linewidth=1.1, **named)
        named = {"label": f"{label}, training"} if number == 0 else {}
        axes.loglog(epochs, training, "--", color=colour, linewidth=0.7, alpha=0.7, **named)
    axes.set(xlabel="epoch or step", ylabel="loss, mm")


def keep_losses(folder: Path, file: str, curves: Mapping[str, Sequence[F64]]) -> None:
    """Write the losses (checks, 3) of the seeds of each net, thinned: they travel with a drawing.

    What was trained stays where it was trained; its losses are what is extrapolated.
    """
    with (folder / file).open("w", encoding="utf-8", newline="") as opened:
        out = csv.writer(opened, lineterminator="\n")
        out.writerow(("net", "seed", "step", "training", "validation"))
        for name, seeds in curves.items():
            for seed, curve in enumerate(seeds):
                out.writerows((name, seed, *(f"{v:.6g}" for v in row)) for row in thinned(curve))


def thinned(curve: F64, count: int = 60) -> F64:
    """Return about `count` rows of a curve, evenly spread in the logarithm, each a local mean."""
    rows = len(curve)
    ends = np.unique(np.geomspace(1, rows, count + 1).astype(int)) - 1
    parts = [curve[a:b] for a, b in pairwise(ends) if b > a]
    return np.array([np.exp(np.log(np.maximum(part, 1e-12)).mean(axis=0)) for part in parts])

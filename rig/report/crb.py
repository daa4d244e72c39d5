"""How far each case lies above the bound of Cramér and Rao, drawn as bars."""

# matplotlib leaves the types of its keywords open.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from rig.report.figure import Figure

QUANTITY = "÷ CRB"
"""The column that is drawn."""


def ratios(figures: Iterable[Figure]) -> list[Figure]:
    """Return the figures of a table that are such ratios."""
    return [figure for figure in figures if figure.quantity == QUANTITY and figure.value]


def draw(figures: list[Figure], path: Path) -> None:
    """Draw one bar a case, logarithmic, the first on top."""
    from matplotlib.figure import Figure as Canvas
    from matplotlib.ticker import NullFormatter, ScalarFormatter

    found = ratios(figures)
    values = [float(figure.value or 0.0) for figure in found]
    canvas = Canvas(figsize=(8.6, 0.8 + 0.33 * len(found)), layout="constrained")
    axes = canvas.subplots()
    colours = ["C3" if figure.case.endswith("(default)") else "C0" for figure in found]
    drawn = axes.barh(range(len(found)), values, color=colours, height=0.65, left=0.0)
    axes.bar_label(drawn, labels=[f"{value:.3g}" for value in values], padding=4, fontsize=9)
    axes.set_yticks(range(len(found)), [figure.case for figure in found], fontsize=9)
    axes.invert_yaxis()
    axes.set(xscale="log", xlim=(0.8, 1.6 * max(values)), xlabel=QUANTITY)
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.axvline(1.0, color="0.3", lw=1)
    axes.spines[["top", "right"]].set_visible(False)
    canvas.savefig(path, dpi=130)

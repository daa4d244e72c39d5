"""Error against run time: the picture, and the settings that no other one beats in both."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from rig.report.figure import Figure

DEFAULT = "(default)"
"""The end of the name of the case that the code takes when nothing is said."""


class Trade(NamedTuple):
    """One setting: its run time and its error."""

    case: str
    time: float
    error: float


def trades(figures: Iterable[Figure]) -> list[Trade]:
    """Return the cases of a table that state both a time and an error as numbers."""
    numbers: dict[str, dict[str, float]] = {}
    for figure in figures:
        if figure.quantity in ("time", "error"):
            number = _number(figure.value)
            if number is not None and number > 0:
                numbers.setdefault(figure.case, {})[figure.quantity] = number
    return [
        Trade(case, both["time"], both["error"]) for case, both in numbers.items() if len(both) == 2
    ]


def front(settings: Iterable[Trade]) -> list[Trade]:
    """Return the settings that no other one beats, the quickest first (the Pareto front)."""
    best: list[Trade] = []
    for setting in sorted(settings, key=lambda setting: (setting.time, setting.error)):
        if not best or setting.error < best[-1].error:
            best.append(setting)
    return best


def draw(figures: list[Figure], path: Path) -> None:
    """Draw one table's settings, time along x and error along y, both logarithmic."""
    from matplotlib.figure import Figure as Canvas

    settings = trades(figures)
    units = {figure.quantity: figure.unit for figure in figures}
    canvas = Canvas(figsize=(7.0, 4.2), layout="constrained")
    axes = canvas.subplots()
    best = front(settings)
    axes.plot([b.time for b in best], [b.error for b in best], color="0.6", lw=1, zorder=1)
    for setting in settings:
        chosen = setting.case.endswith(DEFAULT)
        colour = "C3" if chosen else "C0" if setting in best else "0.6"
        axes.scatter(setting.time, setting.error, color=colour, s=45 if chosen else 22, zorder=2)
        axes.annotate(
            setting.case,
            (setting.time, setting.error),
            xytext=(5, 4),
            textcoords="offset points",
            fontsize=7.5,
            color=colour if chosen else "0.25",
        )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(x=0.18, y=0.12)
    axes.set_xlabel(f"time, {units['time']}")
    axes.set_ylabel(f"error, {units['error']}" if units["error"] else "error, relative")
    axes.grid(True, which="major", color="0.92")
    axes.spines[["top", "right"]].set_visible(False)
    canvas.savefig(path, dpi=130)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None

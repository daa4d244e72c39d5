"""Error against run time: the picture, and the settings that no other one beats in both."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rig.report.figure import Figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
    """Draw one table's settings, time along x and error along y, both logarithmic.

    Settings are numbered from the quickest to the slowest, and named beside the axes.
    """
    from matplotlib.figure import Figure as Canvas

    settings = sorted(trades(figures), key=lambda setting: setting.time)
    best = front(settings)
    canvas = Canvas(figsize=(8.6, max(3.8, 0.9 + 0.17 * len(settings))), layout="constrained")
    axes, names = canvas.subplots(1, 2, width_ratios=(2.0, 1.0))
    names.set_axis_off()
    axes.plot([b.time for b in best], [b.error for b in best], color="0.6", lw=1, zorder=1)
    for number, setting in enumerate(settings, start=1):
        colour = _colour(setting, setting in best)
        point = setting.time, setting.error
        axes.scatter(*point, color=colour, s=28, zorder=2)
        style = {"color": colour, "fontsize": 8}
        axes.annotate(str(number), point, (4, 4), textcoords="offset points", **style)
        height = 1.0 - (number - 0.5) / max(len(settings), 8)
        names.text(0.0, height, f"{number}  {setting.case}", va="center", **style)
    units = {figure.quantity: figure.unit for figure in figures}
    _scale(axes, f"time, {units['time']}", f"error, {units['error'] or 'relative'}")
    canvas.savefig(path, dpi=130)


def _colour(setting: Trade, best: bool) -> str:
    if setting.case.endswith(DEFAULT):
        return "C3"
    return "C0" if best else "0.45"


def _scale(axes: Axes, along: str, up: str) -> None:
    """Make both axes logarithmic, with numbers that people write."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axes.set(xscale="log", yscale="log", xlabel=along, ylabel=up)
    axes.margins(0.1)
    for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 300 * low else (1,)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.grid(True, which="major", color="0.92")
    axes.spines[["top", "right"]].set_visible(False)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None

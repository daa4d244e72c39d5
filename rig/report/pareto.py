"""Error against run time: the plot, and the settings that no other one beats in both."""

# matplotlib leaves the types of its keywords open.
# pyright: reportUnknownMemberType=false

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

    @property
    def is_default(self) -> bool:
        """Whether it is what the code takes when nothing is said."""
        return self.case.endswith(DEFAULT)


def trades(figures: Iterable[Figure]) -> list[Trade]:
    """Return the cases of a table that state both a time and an error as numbers."""
    numbers: dict[str, dict[str, float]] = {}
    for figure in figures:
        if figure.quantity in ("time", "error"):
            number = figure.value
            if isinstance(number, int | float) and number > 0:
                numbers.setdefault(figure.case, {})[figure.quantity] = float(number)
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
        tint = colour(setting, setting in best)
        point = setting.time, setting.error
        axes.scatter(*point, color=tint, s=28, zorder=2)
        style = {"color": tint, "fontsize": 8}
        axes.annotate(str(number), point, (4, 4), textcoords="offset points", **style)
        height = 1.0 - (number - 0.5) / max(len(settings), 8)
        names.text(0.0, height, f"{number}  {setting.case}", va="center", **style)
    scale(axes, figures)
    canvas.savefig(path, dpi=130)


def colour(setting: Trade, best: bool) -> str:
    """Return the colour of a setting: the default, one that none beats, or another."""
    if setting.is_default:
        return "C3"
    return "C0" if best else "0.45"


def _short(value: float, _: int | None) -> str:
    return f"{value:g}"


def scale(axes: Axes, figures: Iterable[Figure]) -> None:
    """Name both axes and make them logarithmic, with numbers that people write."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    units = {figure.quantity: figure.unit for figure in figures}
    along, up = f"time, {units['time']}", f"error, {units['error'] or 'relative'}"
    axes.set(xscale="log", yscale="log", xlabel=along, ylabel=up)
    axes.margins(0.1)
    for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 300 * low else (1,)))
        axis.set_major_formatter(FuncFormatter(_short))
        axis.set_minor_formatter(NullFormatter())
    axes.grid(True, which="major", color="0.92")
    axes.spines[["top", "right"]].set_visible(False)

"""The first picture of a report: error against run time, a panel a study."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rig.report import pareto
from rig.report.figure import Figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ACROSS = 2
NAMES = 9  # settings that are all named; of more only those that none beats


class Panel(NamedTuple):
    """One study's title, and the table of it that is drawn."""

    title: str
    figures: tuple[Figure, ...]


def draw(panels: list[Panel], path: Path) -> None:
    """Draw each table's settings by time and error, those that none beats joined and named."""
    from matplotlib.figure import Figure as Canvas

    down = -(-len(panels) // ACROSS)
    canvas = Canvas(figsize=(10.4, 0.4 + 3.4 * down), layout="constrained")
    every = canvas.subplots(down, ACROSS, squeeze=False).ravel()
    for axes in every[len(panels) :]:
        axes.set_axis_off()
    for axes, panel in zip(every, panels, strict=False):
        _draw(axes, panel)
    canvas.savefig(path, dpi=130)


def _draw(axes: Axes, panel: Panel) -> None:
    settings = pareto.trades(panel.figures)
    best = pareto.front(settings)
    axes.plot([b.time for b in best], [b.error for b in best], color="0.6", lw=1, zorder=1)
    for setting in settings:
        colour = pareto.colour(setting, setting in best)
        point = setting.time, setting.error
        axes.scatter(*point, color=colour, s=26, zorder=2)
        if setting in best or setting.is_default or len(settings) <= NAMES:
            name = setting.case.removesuffix(pareto.DEFAULT).strip()
            style = {"color": colour, "fontsize": 7.5}
            axes.annotate(name, point, (5, 3), textcoords="offset points", **style)
    pareto.scale(axes, panel.figures)
    axes.set_title(panel.title, fontsize=10, loc="left")

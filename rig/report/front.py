"""The first plot of a report: error against run time, a panel a study."""

# matplotlib leaves the types of its keywords open.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.report import pareto
from rig.report.figure import Figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Text
    from matplotlib.transforms import BboxBase

ACROSS = 2
NAMES = 9  # settings that are all named; of more only those that none beats
PLACES = ((6, 3, "left"), (6, -11, "left"), (-6, 3, "right"), (-6, -11, "right"), (0, 8, "center"))
"""Where a name may stand beside its point, in points of print, the best first."""


class Panel(NamedTuple):
    """One study: its name, the title of the table that is drawn, and its figures."""

    name: str
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
    names = [_draw(axes, panel) for axes, panel in zip(every, panels, strict=False)]
    canvas.draw_without_rendering()  # lays the panels out, and their texts
    for axes, texts in zip(every, names, strict=False):
        _spread(axes, texts)
    canvas.savefig(path, dpi=130)


def _draw(axes: Axes, panel: Panel) -> list[Text]:
    """Draw one panel; return the names of its settings."""
    settings = pareto.trades(panel.figures)
    texts: list[Text] = []
    best = pareto.front(settings)
    axes.plot([b.time for b in best], [b.error for b in best], color="0.6", lw=1, zorder=1)
    for setting in settings:
        colour = pareto.colour(setting, setting in best)
        point = setting.time, setting.error
        axes.scatter(*point, color=colour, s=26, zorder=2)
        if setting in best or setting.is_default or len(settings) <= NAMES:
            name = setting.case.removesuffix(pareto.DEFAULT).strip()
            style: dict[str, Any] = {"color": colour, "fontsize": 8, "in_layout": False}
            texts.append(
                axes.annotate(name, point, PLACES[0][:2], textcoords="offset points", **style)
            )
    pareto.scale(axes, panel.figures)
    axes.set_title(panel.name, fontsize=11, loc="left", fontweight="bold", pad=18)
    axes.text(0, 1.03, panel.title, fontsize=8.5, color="0.35", transform=axes.transAxes)
    return texts


def _spread(axes: Axes, texts: list[Text]) -> None:
    """Put each name where it hides no other one and stays inside, as far as that can be."""
    taken: list[BboxBase] = []
    inside = axes.get_window_extent()
    for text in texts:
        for x, y, side in PLACES:
            text.set(position=(x, y), horizontalalignment=side)
            box = text.get_window_extent()
            fits = box.x0 >= inside.x0 and box.x1 <= inside.x1
            if fits and not any(box.overlaps(other) for other in taken):
                break
        taken.append(text.get_window_extent())

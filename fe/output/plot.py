"""A bent plate as a plot: deflection and strain of the touched face, with its touches."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fe.arrays import F64
from fe.output.surface import PlateState, sample, writable, write_whole
from fe.plate.plate import Touch

_LONG_SIDE = 3.6  # inches of one map
_DPI = 130

# A point touch is a logarithmic peak of strain: colours stop where this part of the plate ends.
_SHOWN = 99.5


class _Panel(NamedTuple):
    title: str
    scale: float  # the field is multiplied by this
    colours: str


_PANELS = (
    _Panel("Deflection w, mm", 1.0, "viridis"),
    _Panel("Strain exx, µε", 1e6, "RdBu_r"),
    _Panel("Strain eyy, µε", 1e6, "RdBu_r"),
    _Panel("Shear strain exy (tensor), µε", 1e6, "RdBu_r"),
)


def draw(state: PlateState, touches: Sequence[Touch], path: str | Path) -> None:
    """Draw the deflection and the three strains of the touched face, seen from above.

    Strain colours are symmetric about zero, tension red; they saturate in the half percent of
    the plate where the strain is largest, for a touch at a point is a peak without a top.

    Parameters
    ----------
    state : PlateState
        Of any theory.
    touches : sequence of Touch
        Drawn as crosses with their forces, and as circles where they are discs.
    path : str or Path
        Ends in `.png`, `.pdf` or `.svg`. An existing file is replaced.

    Raises
    ------
    ValueError
        The name ends otherwise, or a touch lies outside the plate.
    OSError
        The folder does not exist or cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    path = writable(path, (".png", ".pdf", ".svg"))
    surface = sample(state, touches)
    on_grid = slice(surface.shape[0] * surface.shape[1])
    fields = np.column_stack([surface.displacement[on_grid, 2], surface.strain[on_grid]])
    width, height = np.array(state.plate.size) * _LONG_SIDE / max(state.plate.size)
    figure: Any = Figure((2 * width + 2.6, 2 * height + 1.4), dpi=_DPI, layout="constrained")
    FigureCanvasAgg(figure)
    plots = figure.subplots(2, 2, sharex=True, sharey=True)
    for axes, panel, values in zip(plots.flat, _PANELS, fields.T, strict=True):
        _map(figure, axes, state.mesh.nodes, values.reshape(surface.shape), panel)
        axes.set(xlim=(0, state.plate.size[0]), ylim=(0, state.plate.size[1]), aspect="equal")
        _mark(axes, touches)
        axes.label_outer()
    content = BytesIO()
    figure.savefig(content, format=path.suffix[1:].lower())
    write_whole(path, content.getvalue())


def _map(figure: Any, axes: Any, nodes: tuple[F64, F64], values: F64, panel: _Panel) -> None:
    values = panel.scale * values
    low, high, extend = _limits(values, panel.colours)
    drawn = axes.pcolormesh(
        *nodes, values, cmap=panel.colours, vmin=low, vmax=high, shading="gouraud", rasterized=True
    )
    bar = figure.colorbar(drawn, ax=axes, extend=extend, shrink=0.9, aspect=25)
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=8)
    axes.tick_params(labelsize=8)
    axes.set_title(panel.title, fontsize=10)
    axes.set_xlabel("x, mm", fontsize=9)
    axes.set_ylabel("y, mm", fontsize=9)


def _limits(values: F64, colours: str) -> tuple[float, float, str]:
    """Set the ends of the colours, and say which of them the values pass.

    They are symmetric about zero where the colours diverge.
    """
    low, high = float(values.min()), float(values.max())
    if colours != "RdBu_r":
        return low, high, "neither"
    limit = float(np.percentile(np.abs(values), _SHOWN))
    return -limit, limit, ("neither", "max", "min", "both")[(high > limit) + 2 * (low < -limit)]


def _mark(axes: Any, touches: Sequence[Touch]) -> None:
    from matplotlib.patches import Circle
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=2.5, foreground="white")]
    ground = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.7}
    for touch in touches:
        axes.plot(touch.x, touch.y, "+", color="black", markersize=7, path_effects=halo)
        axes.add_patch(Circle((touch.x, touch.y), touch.radius, fill=False, linewidth=1))
        # On the rim of the disc, at 45 degrees, towards the middle of the map.
        side = -1 if touch.x > np.mean(axes.get_xlim()) else 1
        axes.annotate(
            f"{touch.force:.3g} N",
            (touch.x + 0.7 * side * touch.radius, touch.y + 0.7 * touch.radius),
            (5 * side, 5),
            textcoords="offset points",
            horizontalalignment="right" if side < 0 else "left",
            fontsize=8,
            bbox=ground,
        )

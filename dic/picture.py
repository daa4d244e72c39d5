"""Fields drawn over the grey reference: one alone, or several on one sheet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dic.displacement import DisplacementField, Status

_STATUS_COLOURS = (
    "#2f9e44", "#ced4da", "#f1c40f", "#343a40", "#f783ac", "#4dabf7", "#e03131", "#7048e8",
    "#8c5a2b",
)  # fmt: skip
_OPACITY = 0.75
_DPI = 100
_TICKS = 5  # at most, on an axis
# Inches about each image: for the numbers and names of the axes, the title, and the scale.
_LEFT, _RIGHT, _BELOW, _ABOVE = 0.75, 1.9, 0.6, 0.4
_ALONE, _ON_SHEET = (9.0, 7.0), (4.0, 4.0)  # inches that the image of one panel may take
_ACROSS = 3  # panels a row of a sheet


@dataclass(frozen=True)
class _Look:
    title: str
    unit: str
    scale: float  # the field is multiplied by this
    colours: str  # perceptually uniform; one that diverges for what has a sign


_LOOKS = {
    "u": _Look("Displacement u, to the right", "px", 1, "viridis"),
    "v": _Look("Displacement v, downwards", "px", 1, "viridis"),
    "exx": _Look("Strain exx", "µε", 1e6, "RdBu_r"),
    "eyy": _Look("Strain eyy", "µε", 1e6, "RdBu_r"),
    "exy": _Look("Shear strain exy (tensor)", "µε", 1e6, "RdBu_r"),
    "sigma_u": _Look("Standard deviation of u", "px", 1, "magma"),
    "sigma_exx": _Look("Standard deviation of exx", "µε", 1e6, "magma"),
    "zncc": _Look("Correlation ZNCC", "1", 1, "cividis"),
    "status": _Look("Status", "", 1, ""),
}


def draw(path: Path, image: NDArray, name: str, values: NDArray, disp: DisplacementField) -> None:
    """Draw the field `values` (N,) called `name` over `image` (H, W) into a PNG at `path`."""
    figure, panels = _frame(image.shape, _ALONE, (1, 1))
    _panel(*panels[0], image, name, values, disp)
    _save(figure, path)


def draw_sheet(
    path: Path, image: NDArray, fields: Mapping[str, NDArray], disp: DisplacementField
) -> None:
    """Draw fields (N,) by name over `image` (H, W), three a row, into one PNG at `path`."""
    rows = -(-len(fields) // _ACROSS)
    figure, panels = _frame(image.shape, _ON_SHEET, (rows, _ACROSS))
    for panel, (name, values) in zip(panels, fields.items(), strict=False):
        _panel(*panel, image, name, values, disp)
    _save(figure, path)


def _panel(
    axes: Axes, beside: Axes, image: NDArray, name: str, values: NDArray, disp: DisplacementField
) -> None:
    """Draw a field over the image, and its scale beside it."""
    height, width = image.shape
    dark, bright = np.percentile(image[::4, ::4], (1, 99))
    axes.imshow(image, cmap="gray", vmin=dark, vmax=bright, interpolation="nearest")
    look = _LOOKS[name]
    if name == "status":
        _draw_status(axes, beside, values, disp)
    else:
        limits = _limits(values * look.scale, look.colours)
        drawn = _map(axes, values * look.scale, disp, look.colours, limits)
        axes.figure.colorbar(drawn, cax=beside, extend="both", label=look.unit)
    axes.set(title=look.title, xlabel="x, px", ylabel="y, px")
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    axes.locator_params(nbins=_TICKS)


def _save(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=_DPI, pil_kwargs={"compress_level": 1})


def _frame(
    shape: tuple[int, ...], most: tuple[float, float], counts: tuple[int, int]
) -> tuple[Figure, list[tuple[Axes, Axes]]]:
    """Figure with room for rows and columns of images (H, W), and beside each for its scale.

    The room is stated and not sought for: a layout that is sought draws everything twice.
    """
    height, width = shape
    across, up = np.array([width, height]) * min(most[0] / width, most[1] / height)
    cell = np.array([across + _LEFT + _RIGHT, up + _BELOW + _ABOVE])
    whole = cell * counts[::-1]
    figure = Figure(figsize=(float(whole[0]), float(whole[1])))
    FigureCanvasAgg(figure)

    def box(x: float, y: float, wide: float) -> Axes:
        return figure.add_axes((x / whole[0], y / whole[1], wide / whole[0], up / whole[1]))

    corners = [
        cell * (column, row) + (_LEFT, _BELOW)
        for row in reversed(range(counts[0]))
        for column in range(counts[1])
    ]
    return figure, [(box(x, y, across), box(x + across + 0.2, y, 0.18)) for x, y in corners]


def _limits(values: NDArray, colours: str) -> tuple[float, float]:
    """Limits that a few wild points do not move; symmetric where the colours diverge."""
    known = values[np.isfinite(values)]
    if len(known) == 0:
        return 0.0, 1.0
    low, high = (float(limit) for limit in np.percentile(known, (1, 99)))
    if colours == "RdBu_r":
        high = max(abs(low), abs(high))
        low = -high
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _map(axes: Axes, values: NDArray, disp: DisplacementField, colours, limits):
    style = {"cmap": colours, "vmin": limits[0], "vmax": limits[1]}
    if disp.grid is None:
        return axes.scatter(*disp.xy.T, c=values, s=30, edgecolors="white", linewidths=0.5, **style)
    half = disp.grid.step / 2
    xs, ys = disp.grid.xs, disp.grid.ys
    extent = (xs[0] - half, xs[-1] + half, ys[-1] + half, ys[0] - half)
    cells = np.ma.masked_invalid(values.reshape(disp.grid.shape))
    return axes.imshow(cells, extent=extent, alpha=_OPACITY, interpolation="nearest", **style)


def _draw_status(axes: Axes, beside: Axes, values: NDArray, disp: DisplacementField) -> None:
    colours = ListedColormap(_STATUS_COLOURS)
    drawn = _map(axes, values.astype(float), disp, colours, (-0.5, len(Status) - 0.5))
    drawn.set_norm(BoundaryNorm(np.arange(len(Status) + 1) - 0.5, len(Status)))
    bar = axes.figure.colorbar(drawn, cax=beside, ticks=np.arange(len(Status)))
    counts = np.bincount(values.astype(int), minlength=len(Status))
    bar.ax.set_yticklabels(
        [f"{s.name.lower().replace('_', ' ')} ({counts[s]})" for s in Status], fontsize=8
    )

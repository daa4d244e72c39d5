"""One field drawn over the grey reference."""

from __future__ import annotations

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
)  # fmt: skip
_OPACITY = 0.75
_DPI = 110
# Inches about the image: for the numbers and names of the axes, the title, and the scale.
_LEFT, _RIGHT, _BELOW, _ABOVE = 0.75, 1.9, 0.6, 0.4


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
    height, width = image.shape
    figure, axes, beside = _frame(width, height)
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
    figure.savefig(path, dpi=_DPI, pil_kwargs={"compress_level": 1})


def _frame(width: int, height: int) -> tuple[Figure, Axes, Axes]:
    """Figure with room for an image and, beside it, for its scale.

    The room is stated and not sought for: a layout that is sought draws everything twice.
    """
    size = np.array([width, height]) * min(9 / width, 7 / height)
    whole = size + np.array([_LEFT + _RIGHT, _BELOW + _ABOVE])
    figure = Figure(figsize=(float(whole[0]), float(whole[1])))
    FigureCanvasAgg(figure)
    left, below = (_LEFT, _BELOW) / whole
    across, up = size / whole
    axes = figure.add_axes((left, below, across, up))
    beside = figure.add_axes((left + across + 0.2 / whole[0], below, 0.18 / whole[0], up))
    return figure, axes, beside


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

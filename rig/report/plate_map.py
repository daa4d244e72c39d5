"""Figures at places of a plate, drawn as maps: a table whose cases are "(x, y) mm"."""

# matplotlib leaves the types of its keywords open.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from rig.report.figure import Figure

_PLACE = re.compile(r"\(([\d.]+), ([\d.]+)\) mm")


def at(x: float, y: float) -> str:
    """Return the name of the case at a place, mm."""
    return f"({x:.2f}, {y:.2f}) mm"


def is_map(figures: Iterable[Figure]) -> bool:
    """Whether every case of a table is a place."""
    return all(_PLACE.fullmatch(figure.case) for figure in figures)


def draw(figures: list[Figure], path: Path) -> None:
    """Draw one map a quantity, side by side; places must fill a grid."""
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure as Canvas

    quantities = list(dict.fromkeys(figure.quantity for figure in figures))
    canvas = Canvas(figsize=(4.6 * len(quantities), 3.9), layout="constrained")
    panels = canvas.subplots(1, len(quantities), squeeze=False)[0]
    for axes, quantity in zip(panels, quantities, strict=True):
        rows = [figure for figure in figures if figure.quantity == quantity]
        x, y, values = _grid(rows)
        low, high = float(values.min()), float(np.quantile(values, 0.95))
        drawn = axes.pcolormesh(x, y, values, norm=LogNorm(low, high), cmap="viridis_r")
        levels = [s * 10.0**e for e in range(-4, 4) for s in (1, 3)]
        within = [level for level in levels if low < level < high]
        lines = axes.contour(x, y, values, levels=within, colors="black", linewidths=0.7)
        axes.clabel(lines, fmt="%g")
        axes.set(title=quantity, xlabel="x, mm", ylabel="y, mm", aspect="equal")
        canvas.colorbar(drawn, ax=axes, label=rows[0].unit, extend="max")
    canvas.savefig(path, dpi=130)


def _grid(rows: list[Figure]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the places along x and y, mm, and the values (Y, X) there."""
    found = [match for row in rows if (match := _PLACE.fullmatch(row.case))]
    places = np.array([[float(match[1]), float(match[2])] for match in found])
    x, column = np.unique(places[:, 0], return_inverse=True)
    y, line = np.unique(places[:, 1], return_inverse=True)
    values = np.full((len(y), len(x)), np.nan)
    values[line, column] = np.array([row.value for row in rows], dtype=float)
    return x, y, values

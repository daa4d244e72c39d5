"""The errors that a design expects, drawn over the plate."""

# matplotlib leaves the types of its keywords open.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from models import ExpectedErrors, shape_over
from rig.design.outlook import Design
from rig.system.arrays import F64

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


LEVELS = (0.25, 0.5, 1.0, 2.0, 4.0)  # mm, of the lines


def draw_map(design: Design, file: Path) -> None:
    """Write the maps of place and force as an image.

    Raises
    ------
    OSError
        If the file cannot be written.
    ValueError
        If its suffix names no format of images.
    """
    from matplotlib.figure import Figure

    errors = design.errors["pattern"]
    figure = Figure(figsize=(10, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    _draw(figure, left, errors, errors.place, "mm at 1 N, or N for 1 mm")
    _draw(figure, right, errors, errors.force, "N")
    left.set_title("error of the place")
    right.set_title("error of the force")
    figure.suptitle(f"{design.title}: one frame, whole pattern", fontsize=10)
    figure.savefig(file, dpi=120)


def _draw(figure: Figure, axes: Axes, errors: ExpectedErrors, values: F64, unit: str) -> None:
    from matplotlib.colors import LogNorm

    xy = errors.touches[:, :2]
    width, height = (xy.max(axis=0) + xy.min(axis=0)).tolist()  # cells lie evenly on the plate
    columns, rows = shape_over((width, height))
    grid = values.reshape(rows, columns)
    norm = LogNorm(float(values.min()), float(np.quantile(values, 0.9)))
    extent = (0.0, width, 0.0, height)
    image = axes.imshow(grid, origin="lower", extent=extent, norm=norm, cmap="viridis_r")
    within = [level for level in LEVELS if values.min() < level < values.max()]
    if within and unit != "N":
        x, y = xy[:columns, 0], xy[::columns, 1]
        lines = axes.contour(x, y, grid, levels=within, colors="black", linewidths=0.8)
        axes.clabel(lines, fmt="%g")
    axes.set(xlabel="x, mm", ylabel="y, mm", aspect="equal")
    figure.colorbar(image, ax=axes, label=unit)

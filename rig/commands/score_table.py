"""Scores as they are shown: tables for people, and the error over the plate as a file."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from rich.table import Table

    from models import ErrorMap, TouchScore

ROWS = {
    "touches": "touches",
    "misses": "missed",
    "mean": "mean, mm",
    "p50": "median, mm",
    "p95": "95 %, mm",
    "max": "largest, mm",
    "rms": "RMS, mm",
    "bound": "bound on RMS, mm",
    "force_error": "force, mean, N",
}
"""Figures of a score in the order in which they are shown."""

OTHERS = {
    "magnitude": "magnitude ± smallest force",
    "bend": "bend ± mm",
    "twist": "twist ± deg",
}
"""What some nets estimate beside places."""

COLUMNS = ("x_mm", "y_mm", "touches", "mean_mm", "largest_mm")


def table(title: str, scores: dict[str, dict[str, float]]) -> Table:
    """Return the scores of a net as a table, in mm."""
    from rich.table import Table

    limit = next(iter(scores.values()))["limit"]
    columns = ["touches", "number", "mean mm", "median mm", "95 % mm", "max mm"]
    shown = Table(*columns, f"below {limit:g} mm", title=title)
    others = {
        name: text for name, text in OTHERS.items() if any(name in r for r in scores.values())
    }
    for text in others.values():
        shown.add_column(text)
    for name, row in scores.items():
        distances = [f"{row[key]:.3f}" for key in ("mean", "p50", "p95", "max")]
        more = [f"{row[key]:.3f}" for key in others]
        shown.add_row(name, f"{row['count']:g}", *distances, f"{row['fraction']:.1%}", *more)
    return shown


def touch_table(title: str, total: TouchScore, bands: list[TouchScore]) -> Table:
    """Return the scores of estimates as a table, a column for each band of forces."""
    from rich.table import Table

    named = ["{:.2g} to {:.2g} N".format(*one.force) for one in bands]
    shown, columns = Table("figure", *named, "all", title=title), [*bands, total]
    for name, text in ROWS.items():
        shown.add_row(text, *(_shown(getattr(one, name)) for one in columns))
    shown.add_row("false touches", *("" for _ in bands), f"{total.false}")
    for index, text in enumerate(("inside 1 σ", "inside 2 σ", "inside 3 σ")):
        shown.add_row(text, *(f"{one.inside[index]:.1%}" if one.inside else "" for one in columns))
    return shown


def _shown(figure: float | None) -> str:
    return "–" if figure is None else f"{figure:.4g}"


def write_map(path: Path, errors: ErrorMap) -> None:
    """Write errors over the plate as CSV, or draw them as PNG.

    Raises
    ------
    ValueError
        If the name of the file ends in neither.
    OSError
        If it cannot be written.
    """
    write = {".csv": _write_csv, ".png": _draw}.get(path.suffix)
    if write is None:
        raise ValueError(f"map '{path}' is no .csv and no .png; name one of these")
    try:
        write(path, errors)
    except OSError as error:
        raise OSError(
            f"map '{path}' cannot be written ({error.strerror or error}); name another place"
        ) from error


def _write_csv(path: Path, errors: ErrorMap) -> None:
    x, y = np.meshgrid(errors.x, errors.y)
    cells = zip(
        *(each.ravel() for each in (x, y, errors.count, errors.mean, errors.largest)), strict=True
    )
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(COLUMNS)
        for place_x, place_y, count, *found in cells:
            written = ("" if np.isnan(figure) else f"{figure:.4g}" for figure in found)
            rows.writerow((f"{place_x:g}", f"{place_y:g}", count, *written))


def _draw(path: Path, errors: ErrorMap) -> None:
    from matplotlib.figure import Figure

    plot: Any = Figure(figsize=(6, 5), layout="constrained")
    axes: Any = plot.subplots()
    width, height = (2 * sides.mean() for sides in (errors.x, errors.y))
    shown = axes.imshow(errors.mean, origin="lower", extent=(0.0, width, 0.0, height))
    plot.colorbar(shown, ax=axes, label="mean error, mm")
    axes.set(xlabel="x, mm", ylabel="y, mm")
    plot.savefig(path, dpi=120)

"""`touchplate design SCENE`: what a bench promises, and what would help it most."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from rig.commands.output import emit, progress

if TYPE_CHECKING:
    from rich.console import Group

    from models import ExpectedErrors
    from rig.design.outlook import Design

WAYS = {"bound": "bound of the pattern", "pattern": "as the scene has it", "strain": "by strain"}
"""How touches are sensed: with a perfect reference, with that of the scene, by strain alone."""

UNITS = {"mm": "mm", "n": "N"}


def design(
    scene: Annotated[str, typer.Argument(help="Name of a shipped scene, or path of a TOML file.")],
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the errors over the plate: *.png.")
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="Replace a value: section.key=value.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Predict errors over the plate, forces, frame rate, and what would help most to change.

    Errors are Cramér-Rao bounds of one touch in one frame under linear theory, with the motion of
    the camera and the light unknown.
    """
    from rig.design.outlook import design as predict
    from rig.scene import load, parse_overrides

    if plot and (plot.suffix != ".png" or not plot.parent.is_dir()):
        raise OSError(f"plot '{plot}' must be a *.png in a folder that exists; name such a one")
    loaded = load(scene, parse_overrides(settings or []))
    with progress("design") as report:
        made = predict(loaded, report)
    if plot:
        from rig.design.plot import draw_map

        draw_map(made, plot)
    emit(_tables(made), _data(made), as_json)


def _figures(errors: ExpectedErrors) -> dict[str, float]:
    """Quantiles over the plate; forces for 1 mm are those of the place at 1 N."""
    needed = errors.force_for(1.0)
    return {
        "place_median_mm": float(np.median(errors.place)),
        "place_p95_mm": float(np.quantile(errors.place, 0.95)),
        "force_median_n": float(np.median(errors.force)),
        "force_for_1_mm_min_n": float(needed.min()),
        "force_for_1_mm_median_n": float(np.median(needed)),
        "force_for_1_mm_p95_n": float(np.quantile(needed, 0.95)),
    }


def _data(made: Design) -> dict[str, Any]:
    errors = made.errors["pattern"]
    over = np.column_stack([errors.touches[:, :2], errors.place, errors.force])
    return {
        "scene": made.title,
        "at_1_n": {way: _figures(errors) for way, errors in made.errors.items()},
        "linear_to_n": made.linear_to,
        "largest_n": made.largest,
        "frame_ms": 1e3 * made.frame,
        "fps": made.rate,
        "changes": [asdict(change) for change in made.changes],
        "map": {"columns": ["x_mm", "y_mm", "place_mm", "force_n"], "rows": over.tolist()},
    }


def _tables(made: Design) -> Group:
    from rich.box import SIMPLE
    from rich.console import Group
    from rich.table import Table

    errors = Table("1 N, one frame", *(WAYS[way] for way in made.errors), box=SIMPLE)
    errors.title = made.title
    columns = [_figures(expected) for expected in made.errors.values()]
    for name in columns[0]:
        *words, unit = name.split("_")
        values = (f"{column[name]:.3g} {UNITS[unit]}" for column in columns)
        errors.add_row(" ".join(words).replace("p95", "95 %"), *values)
    helps = Table("change", "from", "to", "place", "better by", "linear to", box=SIMPLE)
    for change in made.changes:
        place, limit = f"{change.place:.3g} mm", f"{change.linear_to:.2g} N"
        by = f"{100 * (change.gain - 1):+.0f} %"
        helps.add_row(change.what, change.before, change.after, place, by, limit)
    return Group(
        errors,
        _limit(made),
        f"a frame takes {1e3 * made.frame:.0f} ms on this machine: {made.rate:.0f} frames a second",
        helps,
    )


def _limit(made: Design) -> str:
    said = f"linear theory is right to 5 % up to {made.linear_to:.2g} N where the plate is softest"
    if made.largest is None or made.largest <= made.linear_to:
        return said
    return f"{said}; the scene expects {made.largest:g} N, where errors are other than these"

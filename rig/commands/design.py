"""`touchplate design SCENE`: what a bench promises, and what would help it most."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from rig.commands.output import emit, progress, require_folder_of

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table

    from models import ExpectedErrors
    from rig.design.focus import Blur
    from rig.design.outlook import Design
    from rig.design.search import Found
    from rig.design.unknowns import Unknowns

WAYS = {"bound": "bound of the pattern", "pattern": "as the scene has it", "strain": "by strain"}
"""How touches are sensed: with a perfect reference, with that of the scene, by strain alone."""

UNITS = {"mm": "mm", "n": "N"}
GUESS = 12**-0.5
"""Standard deviation of a place along a side, of the side, where nothing is known of it."""


def design(
    scene: Annotated[str, typer.Argument(help="Name of a shipped scene, or path of a TOML file.")],
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the errors over the plate: *.png.")
    ] = None,
    reach: Annotated[
        float | None, typer.Option(min=0, metavar="MM", help="Find what reaches this median error.")
    ] = None,
    at: Annotated[
        float | None,
        typer.Option(min=0, metavar="N", help="Force that is meant, else the scene's least."),
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="Replace a value: section.key=value.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Predict errors over the plate, forces, frame rate, and what would help most to change.

    Errors are Cramér-Rao bounds of one touch in one frame under the theory of the scene, with the
    motion of the camera and the light unknown. A calibration beside the scene says how well its
    bench is known.
    """
    from rig.calibration.store import calibration_beside
    from rig.design.limits import cannot_work
    from rig.design.outlook import design as predict, search_for
    from rig.scene import load, parse_overrides

    if plot:
        require_folder_of(plot, "plot", ".png")
    loaded = load(scene, parse_overrides(settings or []))
    if why := cannot_work(loaded):
        raise ValueError(why)
    with progress("design") as report:
        made = predict(loaded, report, calibration_beside(scene))
    if made.too_stiff:
        raise ValueError(made.too_stiff)
    if plot:
        from rig.design.plot import draw_map

        draw_map(made, plot)
    found = None if reach is None else search_for(loaded, reach, at)
    emit(_tables(made, found), _data(made, found), as_json)


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


def _data(made: Design, found: Found | None) -> dict[str, Any]:
    errors = made.errors["pattern"]
    over = np.column_stack([errors.touches[:, :2], errors.place, errors.force])
    return {
        "scene": made.title,
        "at_1_n": {way: _figures(errors) for way, errors in made.errors.items()},
        "theory": made.theory.name,
        "at_forces": [_at_force(errors) for errors in made.at_forces],
        "unknowns": None if made.unknowns is None else _unknown_data(made.unknowns),
        "reach": None if found is None else asdict(found) | {"reached": found.reached},
        "linear_to_n": made.linear_to,
        "largest_n": made.largest,
        "blur_px": None if made.blur is None else made.blur.circles,
        "frame_ms": 1e3 * made.frame,
        "fps": made.rate,
        "changes": [asdict(change) for change in made.changes],
        "map": {"columns": ["x_mm", "y_mm", "place_mm", "force_n"], "rows": over.tolist()},
    }


def _at_force(errors: ExpectedErrors) -> dict[str, float]:
    force = float(errors.touches[0, 2])
    return {
        "force_n": force,
        "place_median_mm": float(np.median(errors.place)),
        "place_p95_mm": float(np.quantile(errors.place, 0.95)),
        "force_median_n": float(np.median(errors.force)),
        "force_median_percent": 100 * float(np.median(errors.force)) / force,
    }


def _unknown_data(known: Unknowns) -> dict[str, Any]:
    return {
        "force_n": known.force,
        "if_nobody_asks": [asdict(cost) for cost in known.costs],
        "before_presses": _at_force(known.before),
        "after_nine_presses": _at_force(known.after),
        "calibrated": None if known.calibrated is None else _at_force(known.calibrated),
    }


def _tables(made: Design, found: Found | None) -> Group:
    from rich.console import Group

    return Group(
        _errors(made),
        _limit(made),
        *([] if made.blur is None else [_focus(made.blur)]),
        *([_forces(made)] if made.at_forces else []),
        f"a frame takes {1e3 * made.frame:.0f} ms on this machine: {made.rate:.0f} frames a second",
        *([] if made.unknowns is None else _unknown(made.unknowns, _side(made))),
        _changes(made),
        *([] if found is None else _reach(found)),
    )


def _errors(made: Design) -> Table:
    from rich.box import SIMPLE
    from rich.table import Table

    table = Table("1 N, one frame", *(WAYS[way] for way in made.errors), box=SIMPLE)
    table.title = made.title
    columns = [_figures(expected) for expected in made.errors.values()]
    for name in columns[0]:
        *words, unit = name.split("_")
        place, side = words[0] == "place", _side(made)
        values = (
            _place(column[name], side) if place else f"{column[name]:.3g} {UNITS[unit]}"
            for column in columns
        )
        table.add_row(" ".join(words).replace("p95", "95 %"), *values)
    return table


def _side(made: Design) -> float:
    """Return the shorter side of the plate, mm."""
    return min(made.plate.size)


def _place(error: float, side: float) -> str:
    """Write an error of a place, mm; one that is larger than that of a guess is none."""
    return "not found" if error > GUESS * side else f"{error:.3g} mm"


def _forces(made: Design) -> Table:
    from rich.box import SIMPLE
    from rich.table import Table

    table = Table("the scene's forces", "place, median", "place, 95 %", "force", box=SIMPLE)
    for figures in map(_at_force, made.at_forces):
        table.add_row(f"{figures['force_n']:g} N", *_row(figures, _side(made)))
    return table


def _row(figures: dict[str, float], side: float) -> tuple[str, str, str]:
    return (
        _place(figures["place_median_mm"], side),
        _place(figures["place_p95_mm"], side),
        f"{figures['force_median_n']:.3g} N, {figures['force_median_percent']:.2g} %",
    )


def _unknown(known: Unknowns, side: float) -> list[Table]:
    from rich.box import SIMPLE
    from rich.table import Table

    costs = Table(f"{known.force:.2g} N, if it is as usual", "place off", "force off", box=SIMPLE)
    for cost in known.costs:
        costs.add_row(cost.name, f"{cost.place:.2g} mm", f"{100 * cost.force:.2g} %")
    costs.caption = "taken as the scene says and never asked for, each thing alone"
    stated = Table("stated with all of it", "place, median", "place, 95 %", "force", box=SIMPLE)
    stated.add_row("before any press", *_row(_at_force(known.before), side))
    stated.add_row("after nine presses", *_row(_at_force(known.after), side))
    if known.calibrated is not None:
        stated.add_row("as calibrated", *_row(_at_force(known.calibrated), side))
    return [costs, stated]


def _changes(made: Design) -> Table:
    from rich.box import SIMPLE
    from rich.table import Table

    helps = Table("change", "from", "to", "place", "better by", "linear to", box=SIMPLE)
    for change in made.changes:
        place, limit = _place(change.place, _side(made)), f"{change.linear_to:.2g} N"
        by = f"{100 * (change.gain - 1):+.0f} %"
        helps.add_row(change.what, change.before, change.after, place, by, limit)
    return helps


def _reach(found: Found) -> list[Any]:
    from rich.box import SIMPLE
    from rich.table import Table

    wanted = f"{found.place:g} mm under {found.force:g} N"
    if found.now <= found.place:
        return [f"{wanted}: the scene reaches {found.now:.3g} mm as it is"]
    title = "change one of these" if found.alone else "change all of these"
    table = Table(f"for {wanted}, {title}", "from", "to", "place", box=SIMPLE)
    for step in found.alone or found.together:
        before, after = (f"{value:.4g} {step.unit}" for value in (step.before, step.after))
        table.add_row(step.what, before, after, f"{step.place:.3g} mm")
    table.caption = "the cheapest first: turn, print, wait, cut, move, buy"
    missed = f"{wanted} is not reached by all of it; a larger force is, or a smaller plate"
    return [table] if found.reached else [table, missed]


def _focus(blur: Blur) -> str:
    near, far = (f"{circle:.2g}" for circle in blur.circles)
    if near == far:
        return f"out of focus, a point is {near} px wide"
    return f"out of focus, a point is {near} px wide at the near end and {far} at the far end"


def _limit(made: Design) -> str:
    linear = (
        f"linear theory is right to 5 % up to {made.linear_to:.2g} N where the plate is softest"
    )
    if made.theory.name == "large":
        return f"{linear}; errors are those of large deflection"
    if made.largest is None or made.largest <= made.linear_to:
        return linear
    return f"{linear}; the scene expects {made.largest:g} N, where errors are other than these"

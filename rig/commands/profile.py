"""`touchplate profile RESULT --line x1,y1,x2,y2`: lines and extensometers of a whole test."""

from __future__ import annotations

from itertools import count
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.commands.output import emit, folder_aside, progress, require_free, warn

if TYPE_CHECKING:
    from rig.series.read import SeriesResult
    from rig.series.regions import Regions

READINGS = "readings"
Ends = tuple[float, float, float, float]


def profile(
    result: Annotated[Path, typer.Argument(metavar="RESULT", help="fields.h5 of a whole test.")],
    line: Annotated[
        list[str] | None, typer.Option(metavar="X1,Y1,X2,Y2", help="Line to read, px; repeatable.")
    ] = None,
    field: Annotated[
        list[str] | None, typer.Option(help="Field along the lines, else exx; repeatable.")
    ] = None,
    extensometer: Annotated[
        list[str] | None,
        typer.Option(metavar="X1,Y1,X2,Y2", help="Ends of an extensometer, px; repeatable."),
    ] = None,
    regions: Annotated[
        Path | None, typer.Option(metavar="TOML", help="Extensometers and gauges by name.")
    ] = None,
    interval: Annotated[
        float | None, typer.Option(help="Time from frame to frame, s, else they are counted.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder to write to, else RESULT's/profile.")
    ] = None,
    force: Annotated[bool, typer.Option(help="Replace files of an earlier run.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Write lines, and extensometers and gauges over time, with σ, as CSV and plots."""
    from rig.series.read import open_result

    lines = [_ends(text, "line") for text in line or []]
    drawn = _regions(regions, [_ends(text, "extensometer") for text in extensometer or []])
    reads = bool(drawn.extensometer or drawn.gauge)
    if not lines and not reads:
        raise ValueError("nothing to read; name a --line, an --extensometer or --regions")
    if interval is not None and not interval > 0:
        raise ValueError(f"interval must be positive, got {interval:g} s; give the time a frame")
    folder = out or result.parent / "profile"
    require_free(folder, force)
    with open_result(result) as opened, folder_aside(folder) as aside:
        for number, ends in enumerate(lines, start=1):
            _write_line(aside, f"line-{number}", opened, ends, tuple(field or ["exx"]))
        if reads:
            _write_readings(aside, opened, drawn, interval)
        files = sorted(path.name for path in aside.iterdir())
        said = {"folder": str(folder), "frames": len(opened.names), "files": files}
    emit(f"{', '.join(files)} of {said['frames']} frames in {folder}", said, as_json)


def _ends(text: str, what: str) -> Ends:
    try:
        x1, y1, x2, y2 = (float(number) for number in text.split(","))
        if not all(map(isfinite, (x1, y1, x2, y2))):
            raise ValueError
    except ValueError:
        raise ValueError(
            f"{what} must be two points in px, such as 40,60,380,60, got '{text}'; write it so"
        ) from None
    if (x1, y1) == (x2, y2):
        raise ValueError(f"{what} has both ends at ({x1:g}, {y1:g}) px; give it a length")
    return x1, y1, x2, y2


def _regions(path: Path | None, ends: list[Ends]) -> Regions:
    """Regions of a file and extensometers of the command line, which are numbered."""
    from rig.series.regions import Extensometer, Regions, read_regions

    known = read_regions(path) if path else Regions()
    taken = {one.name for one in known.extensometer}
    free = (name for n in count(1) if (name := f"extensometer-{n}") not in taken)
    more = [
        Extensometer(name=name, start=(x1, y1), end=(x2, y2))
        for name, (x1, y1, x2, y2) in zip(free, ends, strict=False)
    ]
    return known.model_copy(update={"extensometer": [*known.extensometer, *more]})


def _write_line(
    folder: Path, name: str, result: SeriesResult, ends: Ends, fields: tuple[str, ...]
) -> None:
    from rig.series.curves import draw_profile
    from rig.series.profile import profiles, write_profiles

    with progress(name) as report:
        found = profiles(result, ends, fields, report)
    length = "px" if result.places is None else "mm"
    write_profiles(folder / f"{name}.csv", result.names, found, length)
    for one in found:
        draw_profile(folder / f"{name}-{one.field}.png", result.names, one, length)


def _write_readings(
    folder: Path, result: SeriesResult, regions: Regions, interval: float | None
) -> None:
    import numpy as np

    from rig.series.curves import draw_readings
    from rig.series.gauges import off_the_points
    from rig.series.readings import readings_of, strain_curves, time_axis, write_readings

    for sentence in off_the_points(regions, result.grid):
        warn(sentence)
    with progress(READINGS) as report:
        table = readings_of(result, regions, report)
    write_readings(folder / f"{READINGS}.csv", result, table, interval)
    curves = strain_curves(table)
    for name, (values, _) in curves.items():
        if not np.isfinite(values).any():
            warn(f"{name} reads nothing in any frame; check whether it lies on measured points")
    draw_readings(folder / f"{READINGS}.png", *time_axis(result, interval), curves)

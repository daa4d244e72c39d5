"""What is seen on the page, as files: by the functions that `profile` and `export` write with."""

from __future__ import annotations

import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import cv2

from rig.series.curves import draw_profile, draw_readings
from rig.series.export import WAYS, write_frame
from rig.series.plots import limits_of, paint_frame
from rig.series.profile import write_profiles
from rig.series.read import SeriesResult
from rig.series.readings import strain_curves, time_axis, write_readings
from rig.system.arrays import AnyArray
from rig.view.asked import AskedGauges, AskedLine
from rig.view.reading import frame_of, read_gauges, read_line


class File(NamedTuple):
    """A file for the browser: its name, its kind and what it holds."""

    name: str
    kind: str
    content: bytes


def frame_table(result: SeriesResult, number: int) -> File:
    """Write all fields of a frame as CSV, a line a point."""
    number = frame_of(result, number)
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"frame-{number:06d}.csv"
        write_frame(path, result, number)
        return _file(path)


def field_plot(
    result: SeriesResult, field: str, number: int, limits: tuple[float, float] | None
) -> File:
    """Draw a field of a frame with its colour bar as PNG, within limits in the unit of plots."""
    number = frame_of(result, number)
    plot = paint_frame(result, field, number, limits or limits_of(result, field))
    return File(f"{field}-{number:06d}.png", "image/png", _png(plot))


def line_files(result: SeriesResult, asked: AskedLine, kind: str) -> File:
    """Write a line of all frames, or a point over time, as CSV or as a plot."""
    line = read_line(result, asked)
    length = "px" if result.places is None else "mm"
    point = len(line.xy) == 1
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"{'point' if point else 'line'}-{asked.field}.{kind}"
        names = result.names if asked.frame is None else [result.names[asked.frame]]
        if kind == "csv":
            write_profiles(path, names, [line], length)
        elif point:
            name = f"{asked.field} at ({asked.ends[0]:g}, {asked.ends[1]:g}) px"
            curves = {name: (line.values[:, 0], line.sigma[:, 0])}
            quantity = f"{asked.field.replace('_', ' ')}, {line.unit}"
            draw_readings(path, *time_axis(result, None), curves, quantity)
        else:
            draw_profile(path, names, line, length)
        return _file(path)


def gauge_files(
    result: SeriesResult, asked: AskedGauges, kind: str, interval: float | None
) -> File:
    """Write what extensometers and gauges read in all frames as CSV or as a plot."""
    table = read_gauges(result, asked)
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"readings.{kind}"
        if kind == "csv":
            write_readings(path, result, table, interval)
        else:
            draw_readings(path, *time_axis(result, interval), strain_curves(table))
        return _file(path)


def whole_test(result: SeriesResult, way: str, field: str) -> File:
    """Write all frames as `touchplate export` does, packed into one ZIP.

    Raises
    ------
    ValueError
        There is no such way.
    """
    if way not in WAYS:
        raise ValueError(f"a test is not exported to '{way}'; use {', '.join(WAYS)}")
    with TemporaryDirectory() as folder:
        paths = WAYS[way](result, Path(folder), field, lambda done, total: None)
        packed = Path(folder) / f"test-{way}.zip"
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for path in paths:
                archive.write(path, path.name)
        return _file(packed)


def _file(path: Path) -> File:
    kinds = {".csv": "text/csv; charset=utf-8", ".png": "image/png", ".zip": "application/zip"}
    return File(path.name, kinds[path.suffix], path.read_bytes())


def _png(plot: AnyArray) -> bytes:
    done, packed = cv2.imencode(".png", plot)
    if not done:
        raise OSError("a plot could not be packed as PNG; export the fields as csv")
    return packed.tobytes()

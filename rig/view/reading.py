"""What is read of a result for the page: points and extensometers over time, lines, limits."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from rig.series.profile import Profile, profiles
from rig.series.read import SeriesResult
from rig.series.readings import curves_of, readings_of, time_axis
from rig.system.arrays import F64
from rig.view.asked import AskedGauges, AskedLine


def read_line(result: SeriesResult, asked: AskedLine) -> Profile:
    """Read a field at a point or along a line, in one frame or in all.

    Raises
    ------
    ValueError
        The line misses all points, or there is no such field or frame.
    OSError
        The file is damaged.
    """
    numbers = None if asked.frame is None else [frame_of(result, asked.frame)]
    return profiles(result, asked.ends, [asked.field], numbers=numbers)[0]


def read_gauges(result: SeriesResult, asked: AskedGauges) -> dict[str, F64]:
    """Read extensometers and gauges with σ, (F,) by name; in one frame if one is asked for.

    Raises
    ------
    OSError, ValueError
        As `read_line`.
    """
    numbers = None if asked.frame is None else [frame_of(result, asked.frame)]
    return readings_of(result, asked.regions, numbers=numbers)


def line_as_json(result: SeriesResult, line: Profile) -> dict[str, Any]:
    """Return a line as the page draws it."""
    return {
        "unit": line.unit,
        "length": "px" if result.places is None else "mm",
        "distance": listed(line.distance),
        "xy": line.xy.tolist(),
        "values": [listed(row) for row in line.values],
        "sigma": [listed(row) for row in line.sigma],
    }


def gauges_as_json(table: dict[str, F64]) -> dict[str, Any]:
    """Return what extensometers and gauges read as the page draws it."""
    return {
        name: {"values": listed(values), "sigma": listed(sigma)}
        for name, (values, sigma) in curves_of(table).items()
    }


def axis_as_json(result: SeriesResult, interval: float | None) -> dict[str, Any]:
    """Return the axis of time."""
    time, name = time_axis(result, interval)
    return {"name": name, "values": time.tolist()}


def frame_of(result: SeriesResult, number: int) -> int:
    """Return the number of a frame.

    Raises
    ------
    ValueError
        There is none of that number.
    """
    if not 0 <= number < len(result.names):
        raise ValueError(
            f"frame {number + 1} is not one of the {len(result.names)} of '{result.path}'; choose"
            " one of them"
        )
    return number


def listed(values: Iterable[float] | F64) -> list[float | None]:
    """Return numbers for JSON, which has none for what is lost."""
    return [float(value) if np.isfinite(value) else None for value in values]

"""Fields along a line, frame by frame, from the result of a whole test."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.series.between import Between, lay
from rig.series.read import SeriesResult
from rig.system.arrays import F64

JUMPING = ("status", "principal_angle", "by_net")
"""Fields between whose points nothing lies: the nearest point is read."""


@dataclass(frozen=True, eq=False)
class Profile:
    """A field along a line, of F frames.

    Attributes
    ----------
    field, unit : str
    xy : (K, 2) float64, px
        Where it was read, a step of the grid apart.
    distance : (K,) float64
        From the start of the line, in px, or in mm on the object where the test has a scale.
    values, sigma : (F, K) float64
        NaN where a point about the place was lost or the line leaves the grid; the σ of a field
        that has none is NaN.
    """

    field: str
    unit: str
    xy: F64
    distance: F64
    values: F64
    sigma: F64


def profiles(
    result: SeriesResult,
    line: tuple[float, float, float, float],
    fields: Sequence[str],
    report: Callable[[int, int], None] = lambda done, total: None,
    numbers: Sequence[int] | None = None,
) -> list[Profile]:
    """Read fields along a line from (x1, y1) to (x2, y2), px, in the frames `numbers`, or in all.

    A value lies between the four points about its place. Its σ takes these for fully correlated:
    an upper bound. A line of no length is a point.

    Raises
    ------
    ValueError
        The line misses all points, or there is no such field.
    """
    xy = _places(line, result.grid.step)
    between = lay(result.grid, xy)
    if not np.isfinite(between.weights).any():
        raise ValueError(
            f"line {','.join(f'{c:g}' for c in line)} px misses all points of the test, which lie"
            f" from ({result.grid.xs[0]}, {result.grid.ys[0]}) to ({result.grid.xs[-1]},"
            f" {result.grid.ys[-1]}) px; draw it there"
        )
    distance = _distance(result, between, xy)
    chosen = range(len(result.names)) if numbers is None else numbers
    shape = len(chosen), len(xy)
    found = [
        Profile(name, unit, xy, distance, np.full(shape, np.nan), np.full(shape, np.nan))
        for name, unit in ((name, result.unit(name)) for name in fields)
    ]
    for row, number in enumerate(chosen):
        for one in found:
            where = between.nearest() if one.field in JUMPING else between
            one.values[row] = where.read(result.field(one.field, number))
            if f"sigma_{one.field}" in result.fields:
                one.sigma[row] = where.read(result.field(f"sigma_{one.field}", number))
        report(row + 1, shape[0])
    return found


def write_profiles(
    path: Path, names: Sequence[str], profiles: Sequence[Profile], length: str
) -> None:
    """Write profiles of one line as CSV, a line a place and frame; `length` is that of distance."""
    head = ["number", "frame", "x", "y", f"distance_{length}"]
    columns = [column for one in profiles for column in (one.field, f"sigma_{one.field}")]
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow([*head, *columns])
        table.writerows(_rows(names, profiles))


def _rows(names: Sequence[str], profiles: Sequence[Profile]) -> Iterator[list[object]]:
    line = profiles[0]
    for number, name in enumerate(names):
        for k, (x, y) in enumerate(line.xy.tolist()):
            pairs = [(one.values[number, k], one.sigma[number, k]) for one in profiles]
            values = [f"{value:.9g}" for pair in pairs for value in pair]
            yield [number, name, f"{x:.6g}", f"{y:.6g}", f"{line.distance[k]:.9g}", *values]


def _places(line: tuple[float, float, float, float], step: int) -> F64:
    """Places (K, 2) px along a line, no more than a step apart."""
    start, end = np.array(line[:2]), np.array(line[2:])
    length = float(np.linalg.norm(end - start))
    along = np.linspace(0, 1, int(np.ceil(length / step)) + 1)
    return start + along[:, None] * (end - start)


def _distance(result: SeriesResult, between: Between, xy: F64) -> F64:
    """Distance (K,) from the first place, on the object where that is known."""
    if result.places is None:
        return np.linalg.norm(xy - xy[0], axis=1)
    places = np.stack([between.read(result.places[..., k]) for k in range(2)], axis=1)
    inside = places[np.isfinite(places).all(axis=1)]
    return np.linalg.norm(places - inside[0], axis=1)

"""What extensometers and gauges read in a frame, each with its σ."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import dic
from dic import export
from rig.series.gauges import SIGMA_UV, UV, elongation, gauge_strain
from rig.series.invariants import STRAINS
from rig.series.measure import BLOCK
from rig.series.read import SeriesResult
from rig.series.regions import Regions
from rig.series.scale import SCALED
from rig.system.arrays import F64, AnyArray


@dataclass(frozen=True, eq=False)
class Reader:
    """Regions laid on the points of a test.

    Attributes
    ----------
    regions : Regions
    grid : dic.Grid
    vsg : float, px
        Distance from which the errors of two strains are free of each other.
    places : (R·C, 2) float64, mm, or None
        Where the points are on the object, which is what lengths are of; None for px.
    """

    regions: Regions
    grid: dic.Grid
    vsg: float
    places: F64 | None = None

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the fields that are read."""
        lengths = UV + SIGMA_UV if self.places is None else SCALED
        strains = tuple(f"{prefix}{name}" for prefix in ("", "sigma_") for name in STRAINS)
        return (lengths if self.regions.extensometer else ()) + (
            strains if self.regions.gauge else ()
        )

    def read(self, table: Mapping[str, AnyArray]) -> dict[str, float]:
        """Read a frame, by name of extensometer and by name and strain of gauge; NaN where lost.

        Parameters
        ----------
        table : mapping of (R·C,)
            Displacement, strain and their σ by name.
        """
        row: dict[str, float] = {}
        for one in self.regions.extensometer:
            value = elongation(one, self.grid, table, self.places)
            row[one.name], row[f"sigma_{one.name}"] = value
        for gauge in self.regions.gauge:
            for field, value in gauge_strain(gauge, self.grid, table, self.vsg).items():
                row[f"{gauge.name}_{field}"], row[f"sigma_{gauge.name}_{field}"] = value
        return row


def reach(field: str, window: int, step: int, subset: int) -> float:
    """Distance from which the errors of two strains are free of each other, px."""
    return (window - 1) * step + subset if field in ("subset", "split") else BLOCK


def readings_of(
    result: SeriesResult,
    regions: Regions,
    report: Callable[[int, int], None] = lambda done, total: None,
    numbers: Sequence[int] | None = None,
) -> dict[str, F64]:
    """Read extensometers and gauges in the frames `numbers`, or in all, with σ, (F,) by name.

    Raises
    ------
    OSError
        A part of the file is damaged.
    """
    settings, grid = result.settings, result.grid
    vsg = reach(str(settings["field"]), int(settings["strain_window"]), grid.step, grid.subset)
    places = None if result.places is None else result.places.reshape(-1, 2)
    reader = Reader(regions, grid, vsg, places)
    rows: list[dict[str, float]] = []
    chosen = range(len(result.names)) if numbers is None else numbers
    for row, number in enumerate(chosen):
        frame = {name: result.field(name, number).ravel() for name in reader.fields}
        rows.append(reader.read(frame))
        report(row + 1, len(chosen))
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def write_readings(
    path: Path, result: SeriesResult, table: Mapping[str, F64], interval: float | None
) -> None:
    """Write readings as CSV, a line a frame; with `interval`, s from frame to frame, its time."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["number", "frame", *([] if interval is None else ["time_s"]), *table])
        for n, name in enumerate(result.names):
            when = [] if interval is None else [f"{n * interval:.9g}"]
            writer.writerow([n, name, *when, *(f"{values[n]:.9g}" for values in table.values())])


def curves_of(table: Mapping[str, F64]) -> dict[str, tuple[F64, F64]]:
    """Pair what was read with its σ, by name."""
    return {
        name: (values, table[f"sigma_{name}"])
        for name, values in table.items()
        if f"sigma_{name}" in table
    }


def strain_curves(table: Mapping[str, F64]) -> dict[str, tuple[F64, F64]]:
    """As `curves_of`, but for invariants: what is drawn together has one unit."""
    curves = curves_of(table).items()
    return {name: curve for name, curve in curves if not name.endswith(export.INVARIANTS)}


def time_axis(result: SeriesResult, interval: float | None) -> tuple[F64, str]:
    """Return the times of the frames (F,), and the name of their axis; without one they count."""
    count = np.arange(len(result.names), dtype=np.float64)
    return (count, "frame") if interval is None else (count * interval, "time, s")

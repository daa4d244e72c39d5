"""A pair of `touchplate correlate`: its files, and its figures for people and programs."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.commands.output import emit, folder_aside, say, warn
from rig.commands.statuses import status_lines

if TYPE_CHECKING:
    import numpy as np
    from rich.console import Group

    import dic
    from rig.series.measure import FrameField
    from rig.series.regions import Regions
    from rig.series.tabulate import Measured, StrainOptions

PRINTED = {"u": (1.0, "px"), "v": (1.0, "px")} | dict.fromkeys(("exx", "eyy", "exy"), (1e6, "µε"))
"""Factor and unit in which each field is printed."""


@dataclass(frozen=True)
class Written:
    """How a pair is put out: each field drawn alone, files replaced, JSON."""

    plots: bool
    force: bool
    as_json: bool


def correlate(
    folder: Path,
    ref: dic.Reference,
    after: tuple[str, np.ndarray],
    regions: Regions,
    strain: StrainOptions,
    how: Written,
) -> None:
    """Correlate the image `after`, its name and its pixels; write its fields and what regions read.

    Raises
    ------
    OSError, ValueError
        The image does not fit the reference, or the folder cannot be written.
    """
    from rig.series.measure import measure, nothing_measured
    from rig.series.run import reader_of, remove_earlier, write_pair
    from rig.series.tabulate import strained

    name, image = after
    start = time.perf_counter()
    measured = measure(ref, image, strain.field, strain.guess)
    found = strained(measured.disp, strain, measured.by_net)
    seconds = time.perf_counter() - start
    say(ref.prefilter.reason)
    error = nothing_measured(found.disp, image)
    if error:
        warn(f"{name}: {error}")
    more = _of_net(measured) | {"vsg": float(found.strain.vsg)}
    with folder_aside(folder) as aside:
        write_pair(aside, ref, name, found, error, regions, strain, more)
        _write_more(aside, ref, found, how.plots)
        written = {path.name for path in aside.iterdir()}
    remove_earlier(folder, written)
    read = reader_of(ref, regions, strain).read(found.table(strain.fields))
    figures = (
        _figures(found.disp, found.strain)
        | _of_net(measured)
        | {
            "prefilter": ref.prefilter.sigma,
            "readings": _readings(read),
            "seconds": seconds,
            "folder": str(folder),
        }
    )
    emit(_tables(figures), figures, how.as_json)


def _write_more(folder: Path, ref: dic.Reference, found: Measured, plots: bool) -> None:
    from dic import export
    from rig.series.run import SHEET, TABLE

    export.write_csv(folder / TABLE, found.disp, found.strain, found.more)
    export.draw_overview(folder / SHEET, ref.image, found.disp, found.strain)
    if plots:
        export.draw_fields(folder, ref.image, found.disp, found.strain)


def _figures(field: dic.DisplacementField, strain: dic.StrainField) -> dict[str, Any]:
    from dic import Status

    return {
        "points": len(field.xy),
        "status": {s.name.lower(): float((field.status == s).mean()) for s in Status},
        "u": _spread(field.u, field.sigma_u),
        "v": _spread(field.v, field.sigma_v),
        "exx": _spread(strain.exx, strain.sigma[:, 0]),
        "eyy": _spread(strain.eyy, strain.sigma[:, 1]),
        "exy": _spread(strain.exy, strain.sigma[:, 2]),
        "strain_points": int(strain.valid.sum()),
        "strain_kind": strain.kind,
        "vsg": float(strain.vsg),
    }


def _spread(values: np.ndarray, sigma: np.ndarray) -> dict[str, float] | None:
    """Mean and scatter over the measured points, and their median σ; None where there are none."""
    import numpy as np

    measured = np.isfinite(values) & np.isfinite(sigma)
    if not measured.any():
        return None
    return {
        "mean": float(values[measured].mean()),
        "sd": float(values[measured].std()),
        "sigma": float(np.median(sigma[measured])),
    }


def _of_net(measured: FrameField) -> dict[str, object]:
    """Figures of a net: the fraction of the points that are its own, and a sentence on the rest."""
    if measured.fraction is None:
        return {}
    return {"by_net_fraction": measured.fraction, "by_net_reason": measured.reason}


def _readings(row: dict[str, float]) -> dict[str, float | None]:
    """Return what regions read as JSON has it, None where it is lost."""
    from math import isfinite

    return {name: value if isfinite(value) else None for name, value in row.items()}


def _tables(figures: dict[str, Any]) -> Group:
    from rich.box import SIMPLE
    from rich.console import Group
    from rich.table import Table

    fields = Table("field", "mean", "sd", "median σ", "unit", box=SIMPLE)
    for name, (scale, unit) in PRINTED.items():
        spread = figures[name]
        row = (
            [f"{spread[key] * scale:.4g}" for key in ("mean", "sd", "sigma")]
            if spread
            else ["-"] * 3
        )
        fields.add_row(name, *row, unit)
    return Group(
        *status_lines(figures["points"], figures["status"]),
        fields,
        f"strain is {figures['strain_kind']}, gauge length {figures['vsg']:g} px,"
        f" at {figures['strain_points']} points",
        *_read_lines(figures["readings"]),
        *([figures["by_net_reason"]] if "by_net_reason" in figures else []),
        f"correlated in {figures['seconds']:.2f} s; written to {figures['folder']}",
    )


def _read_lines(readings: dict[str, float | None]) -> list[str]:
    """Return a line a reading, with its σ."""
    pairs = [(name, value, readings.get(f"sigma_{name}")) for name, value in readings.items()]
    known = [one for one in pairs if f"sigma_{one[0]}" in readings]
    return [
        f"{name}: nothing measured there"
        if value is None or sigma is None
        else f"{name}: {value:.6g} ± {sigma:.2g}"
        for name, value, sigma in known
    ]

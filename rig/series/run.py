"""A whole test, from its frames to its files: the fields, their grid and what regions read."""

from __future__ import annotations

import csv
import hashlib
import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import dic
from dic import export
from rig.series.correlate import correlate_frames, correlate_on_workers
from rig.series.follow import follow_frames
from rig.series.frames import Frames
from rig.series.parts import open_parts, read_part
from rig.series.readings import Reader
from rig.series.regions import Regions
from rig.series.result import write_result, write_xdmf
from rig.series.tabulate import StrainOptions

PARTS, FIELDS, GRID, READINGS = "parts", "fields.h5", "fields.xdmf", "readings.csv"
"""What a test leaves in its folder; the parts are gone when it is done."""


@dataclass(frozen=True)
class SeriesOutcome:
    """What became of a test.

    Attributes
    ----------
    frames : int
    errors : tuple of (name, sentence)
        Frames that were left out, and why.
    seconds : float
        Time that the correlation took.
    """

    frames: int
    errors: tuple[tuple[str, str], ...]
    seconds: float


def run_series(
    folder: Path,
    ref: dic.Reference,
    frames: Frames,
    regions: Regions,
    strain: StrainOptions,
    workers: int | None = None,
    follow: bool = False,
    cluster: str | None = None,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> SeriesOutcome:
    """Correlate all frames; write the HDF5, its XDMF and what the regions read.

    A test that was stopped in this folder goes on. With `follow` the frames are taken in turn and
    the reference is renewed; with `cluster`, the address of a Dask scheduler, its workers correlate
    them.

    Raises
    ------
    OSError
        The folder holds parts of another test, or cannot be written; the scheduler is not there.
    ValueError
        The points of the reference lie on no grid.
    """
    if ref.grid is None:
        raise ValueError("a whole test is correlated on a grid; leave out the points")
    parts, settings = folder / PARTS, _settings(ref, frames, strain) | {"follow": follow}
    open_parts(parts, settings)
    start = time.perf_counter()
    if follow:
        follow_frames(ref, frames, parts, strain, report)
    elif cluster is not None:
        correlate_on_workers(cluster, ref, frames, parts, strain, report)
    else:
        correlate_frames(ref, frames, parts, strain, workers, report)
    seconds = time.perf_counter() - start
    attributes = {name: value for name, value in settings.items() if name != "frames"}
    places = None if strain.scaled is None else strain.scaled.places
    write_result(folder / FIELDS, parts, frames.names, ref, strain.fields, attributes, places)
    write_xdmf(folder / GRID, folder / FIELDS, len(frames.names), ref.grid, strain.fields)
    errors = tuple(_errors(parts, frames))
    if regions.extensometer or regions.gauge:
        _write_readings(folder / READINGS, parts, frames, ref, regions, strain)
    shutil.rmtree(parts)
    return SeriesOutcome(len(frames.names), errors, seconds)


def _settings(ref: dic.Reference, frames: Frames, strain: StrainOptions) -> dict[str, object]:
    """List what the parts of a test depend on: images, subset, and how they are compared."""
    scaled = strain.scaled
    settings: dict[str, object] = {
        "reference": hashlib.sha256(ref.image.tobytes()).hexdigest(),
        "roi": hashlib.sha256(ref.texture[3].tobytes()).hexdigest(),
        "frames": list(frames.names),
        "subset": ref.subset,
        "step": ref.grid.step if ref.grid else 0,
        "order": ref.order,
        "prefilter": ref.prefilter.sigma,
        "strain_window": strain.window,
        "strain_kind": strain.kind,
        "field": strain.field,
        "invariants": strain.invariants,
    }
    return settings | ({} if scaled is None else scaled.settings)


def _errors(parts: Path, frames: Frames) -> list[tuple[str, str]]:
    read = ((name, read_part(parts, n)) for n, name in enumerate(frames.names))
    return [(name, part[1]) for name, part in read if part is not None and part[1]]


def _write_readings(
    path: Path,
    parts: Path,
    frames: Frames,
    ref: dic.Reference,
    regions: Regions,
    strain: StrainOptions,
) -> None:
    """Write what each extensometer and gauge reads, with its σ, a line a frame."""
    with export.aside(path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        table: csv.DictWriter[str] | None = None
        for row in _readings(parts, frames, ref, regions, strain):
            if table is None:
                table = csv.DictWriter(file, list(row))
                table.writeheader()
            table.writerow(row)


def _readings(
    parts: Path, frames: Frames, ref: dic.Reference, regions: Regions, strain: StrainOptions
) -> Iterator[dict[str, str | float]]:
    if ref.grid is None:
        return
    places = None if strain.scaled is None else strain.scaled.places
    reader = Reader(regions, ref.grid, strain.reach(ref), places)
    for number, name in enumerate(frames.names):
        part = read_part(parts, number)
        if part is not None:
            yield {"frame": name} | reader.read(part[0])

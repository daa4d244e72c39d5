"""A whole test, from its frames to its files: the fields, their grid and what regions read."""

from __future__ import annotations

import csv
import hashlib
import shutil
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path

import dic
from dic import export
from rig.series.correlate import Cluster, correlate_frames, correlate_on_workers
from rig.series.follow import follow_frames
from rig.series.frames import Frames
from rig.series.measure import fingerprint_of, kind_of
from rig.series.outcome import SeriesOutcome, outcome
from rig.series.parts import open_parts, read_part, write_part
from rig.series.readings import Reader
from rig.series.regions import Regions
from rig.series.result import write_result, write_xdmf
from rig.series.tabulate import Measured, StrainOptions

PARTS, FIELDS, GRID, READINGS = "parts", "fields.h5", "fields.xdmf", "readings.csv"
"""What a test leaves in its folder; the parts are gone when it is done."""
TABLE, SHEET = "fields.csv", "fields.png"
"""What a pair leaves beside that, and plots of single fields."""

_REPLACED = {READINGS, TABLE, SHEET, *(f"{name}.png" for name in export.DRAWN)}


def run_series(
    folder: Path,
    ref: dic.Reference,
    frames: Frames,
    regions: Regions,
    strain: StrainOptions,
    workers: int | None = None,
    follow: bool = False,
    cluster: Cluster | None = None,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> SeriesOutcome:
    """Correlate all frames; write the HDF5, its XDMF and what the regions read.

    A test that was stopped in this folder goes on, if the frames hold what they held. With `follow`
    the frames are taken in turn and the reference is renewed; with `cluster` its workers correlate
    them.

    Raises
    ------
    OSError
        The folder holds parts of another test, or cannot be written; the scheduler is not there,
        or has no worker.
    ValueError
        The points of the reference lie on no grid.
    """
    if ref.grid is None:
        raise ValueError("a whole test is correlated on a grid; leave out the points")
    contents = hashlib.sha256(" ".join(frames.contents()).encode()).hexdigest()
    more = {"contents": contents, "follow": follow}
    parts, settings = folder / PARTS, _settings(ref, frames.names, strain) | more
    open_parts(parts, settings)
    start = time.perf_counter()
    if follow:
        follow_frames(ref, frames, parts, strain, report)
    elif cluster is not None:
        correlate_on_workers(cluster, ref, frames, parts, strain, report)
    else:
        correlate_frames(ref, frames, parts, strain, workers, report)
    seconds = time.perf_counter() - start
    _assemble(folder, frames.names, ref, regions, strain, settings)
    done = outcome(parts, frames.names, seconds)
    shutil.rmtree(parts)
    return done


def write_pair(
    folder: Path,
    ref: dic.Reference,
    name: str,
    found: Measured,
    error: str,
    regions: Regions,
    strain: StrainOptions,
    more: Mapping[str, object],
) -> None:
    """Write a pair as a test of one frame called `name`: what reads a test reads it too.

    `more` are attributes beside those of a test.

    Raises
    ------
    OSError
        The folder cannot be written.
    ValueError
        The points of the reference lie on no grid.
    """
    parts, settings = folder / PARTS, _settings(ref, (name,), strain) | {"follow": False, **more}
    open_parts(parts, settings)
    write_part(parts, 0, found.table(strain.fields), error)
    _assemble(folder, (name,), ref, regions, strain, settings)
    shutil.rmtree(parts)


def remove_earlier(folder: Path, written: Collection[str]) -> None:
    """Remove files of an earlier run that another one, which has `written` these, has none of."""
    for name in _REPLACED.difference(written):
        (folder / name).unlink(missing_ok=True)


def reader_of(ref: dic.Reference, regions: Regions, strain: StrainOptions) -> Reader:
    """Lay regions on the points of a reference.

    Raises
    ------
    ValueError
        The points of the reference lie on no grid.
    """
    if ref.grid is None:
        raise ValueError("regions are read on a grid; leave out the points")
    places = None if strain.scaled is None else strain.scaled.places
    return Reader(regions, ref.grid, strain.reach(ref), places)


def _assemble(
    folder: Path,
    names: Sequence[str],
    ref: dic.Reference,
    regions: Regions,
    strain: StrainOptions,
    settings: Mapping[str, object],
) -> None:
    """Put the parts of all frames together into the files of a test."""
    if ref.grid is None:
        raise ValueError("a whole test is correlated on a grid; leave out the points")
    parts = folder / PARTS
    attributes = {name: value for name, value in settings.items() if name != "frames"}
    places = None if strain.scaled is None else strain.scaled.places
    write_result(folder / FIELDS, parts, names, ref, strain.fields, attributes, places)
    write_xdmf(folder / GRID, folder / FIELDS, len(names), ref.grid, strain.fields)
    if regions.columns:
        _write_readings(folder / READINGS, parts, names, reader_of(ref, regions, strain))


def _settings(ref: dic.Reference, names: Sequence[str], strain: StrainOptions) -> dict[str, object]:
    """List what the parts of a test depend on: images, subset, and how they are compared."""
    scaled = strain.scaled
    settings: dict[str, object] = {
        "reference": hashlib.sha256(ref.image.tobytes()).hexdigest(),
        "roi": hashlib.sha256(ref.texture[3].tobytes()).hexdigest(),
        "frames": list(names),
        "subset": ref.subset,
        "step": ref.grid.step if ref.grid else 0,
        "order": ref.order,
        "prefilter": ref.prefilter.sigma,
        "stills": ref.stills,
        "scatter": ref.scatter.tolist(),
        "strain_window": strain.window,
        "strain_kind": strain.kind,
        "field": kind_of(strain.field),
        "invariants": strain.invariants,
    }
    net = fingerprint_of(strain.field)
    settings |= {"net": net} if net else {}
    guess = {} if strain.guess is None else {"guess": list(strain.guess)}
    return settings | guess | ({} if scaled is None else scaled.settings)


def _write_readings(path: Path, parts: Path, names: Sequence[str], reader: Reader) -> None:
    """Write what each extensometer and gauge reads, with its σ, a line a frame."""
    with export.aside(path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        table: csv.DictWriter[str] | None = None
        for row in _readings(parts, names, reader):
            if table is None:
                table = csv.DictWriter(file, list(row))
                table.writeheader()
            table.writerow(row)


def _readings(
    parts: Path, names: Sequence[str], reader: Reader
) -> Iterator[dict[str, str | float]]:
    for number, name in enumerate(names):
        part = read_part(parts, number)
        if part is not None:
            yield {"frame": name} | reader.read(part[0])

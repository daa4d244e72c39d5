"""A whole test of `touchplate correlate`: its frames, its parts, its files."""

from __future__ import annotations

import csv
import hashlib
import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.output import emit, progress, require_free, say, warn

if TYPE_CHECKING:
    import dic
    from rig.series.frames import Frames
    from rig.series.regions import Regions
    from rig.series.tabulate import StrainOptions

PARTS, FIELDS, GRID, READINGS = "parts", "fields.h5", "fields.xdmf", "readings.csv"
_SHOWN = 5  # errors of frames that are written out


@dataclass(frozen=True)
class Run:
    """How a test is run: threads, whether files are replaced, JSON, a renewed reference."""

    workers: int | None
    force: bool
    as_json: bool
    follow: bool


def frames_of(deformed: str) -> Frames | None:
    """Open the frames of a test; None where one image is named."""
    from rig.series.frames import ImageFiles, open_frames

    path = Path(deformed)
    if path.is_file() and path.suffix.lower() not in (".tif", ".tiff"):
        frames = open_frames(deformed)
        return None if isinstance(frames, ImageFiles) else frames
    if not any(letter in deformed for letter in "*?[") and not path.exists():
        return None  # one image, which is then not found
    frames = open_frames(deformed)
    return None if isinstance(frames, ImageFiles) and path.is_file() else frames


def correlate(
    folder: Path,
    ref: dic.Reference,
    frames: Frames,
    regions: Regions,
    strain: StrainOptions,
    how: Run,
) -> None:
    """Correlate all frames; write the HDF5, its XDMF and what the regions read."""
    from rig.series.correlate import correlate_frames
    from rig.series.follow import follow_frames
    from rig.series.parts import open_parts
    from rig.series.result import write_result, write_xdmf

    parts, settings = folder / PARTS, _settings(ref, frames, strain) | {"follow": how.follow}
    if how.force and folder.exists():
        shutil.rmtree(parts, ignore_errors=True)
    if not parts.exists():
        require_free(folder, how.force)
    open_parts(parts, settings)
    if ref.grid is None:
        raise ValueError("a whole test is correlated on a grid; leave out the points")
    start, total = time.perf_counter(), len(frames.names)
    with progress("correlating") as report:
        if how.follow:
            follow_frames(ref, frames, parts, strain, report)
        else:
            correlate_frames(ref, frames, parts, strain, how.workers, report)
    seconds = time.perf_counter() - start
    attributes = {name: value for name, value in settings.items() if name != "frames"}
    places = None if strain.scaled is None else strain.scaled.places
    write_result(folder / FIELDS, parts, frames.names, ref, strain.fields, attributes, places)
    write_xdmf(folder / GRID, folder / FIELDS, total, ref.grid, strain.fields)
    errors = _errors(parts, frames)
    if regions.extensometer or regions.gauge:
        _write_readings(folder / READINGS, parts, frames, ref, regions, strain)
    shutil.rmtree(parts)
    for name, error in errors[:_SHOWN]:
        warn(f"{name}: {error}")
    say(ref.prefilter.reason)
    figures = {
        "frames": total,
        "left_out": len(errors),
        "points": len(ref.xy),
        "seconds": seconds,
        "prefilter": ref.prefilter.sigma,
        "folder": str(folder),
    }
    text = f"{total} frames, {len(errors)} left out; {seconds:.1f} s; written to {folder}"
    emit(text, figures, how.as_json)


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
    from rig.series.parts import read_part

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
    from dic import export

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
    from rig.series.parts import read_part
    from rig.series.readings import Reader

    if ref.grid is None:
        return
    places = None if strain.scaled is None else strain.scaled.places
    reader = Reader(regions, ref.grid, strain.reach(ref), places)
    for number, name in enumerate(frames.names):
        part = read_part(parts, number)
        if part is not None:
            yield {"frame": name} | reader.read(part[0])

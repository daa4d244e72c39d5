"""A whole test of `touchplate correlate`: its frames, its parts, its files."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.output import emit, progress, require_free, say, warn

if TYPE_CHECKING:
    import dic
    from rig.series.frames import Frames
    from rig.series.regions import Regions
    from rig.series.tabulate import StrainOptions

_SHOWN = 5  # errors of frames that are written out


@dataclass(frozen=True)
class Run:
    """How a test is run: threads, whether files are replaced, JSON, a renewed reference, where."""

    workers: int | None
    force: bool
    as_json: bool
    follow: bool
    cluster: str | None = None


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
    from rig.series.run import PARTS, run_series

    parts = folder / PARTS
    if how.force and folder.exists():
        shutil.rmtree(parts, ignore_errors=True)
    if not parts.exists():
        require_free(folder, how.force)
    with progress("correlating") as report:
        done = run_series(
            folder, ref, frames, regions, strain, how.workers, how.follow, how.cluster, report
        )
    for name, error in done.errors[:_SHOWN]:
        warn(f"{name}: {error}")
    say(ref.prefilter.reason)
    figures = {
        "frames": done.frames,
        "left_out": len(done.errors),
        "points": len(ref.xy),
        "seconds": done.seconds,
        "prefilter": ref.prefilter.sigma,
        "folder": str(folder),
    }
    text = (
        f"{done.frames} frames, {len(done.errors)} left out; {done.seconds:.1f} s; written to"
        f" {folder}"
    )
    emit(text, figures, how.as_json)

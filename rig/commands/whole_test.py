"""A whole test of `touchplate correlate`: its frames, its parts, its files."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.commands.output import emit, progress, require_free, say, warn
from rig.commands.photographs import say_if_coloured
from rig.commands.statuses import status_lines

if TYPE_CHECKING:
    import dic
    from rig.series.frames import Frames
    from rig.series.outcome import SeriesOutcome
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
    from rig.series.correlate import Cluster
    from rig.series.measure import unreadable_net
    from rig.series.run import PARTS, READINGS, remove_earlier, run_series

    if missing := unreadable_net(strain.field):
        warn(f"all points are of the adaptive field: {missing}")
    parts = folder / PARTS
    if how.force and folder.exists():
        shutil.rmtree(parts, ignore_errors=True)
    if not parts.exists():
        require_free(folder, how.force)
    cluster = Cluster(how.cluster, warn) if how.cluster else None
    say_if_coloured(frames)
    say(ref.prefilter.reason)
    with progress("correlating") as report:
        where = how.workers, how.follow, cluster
        done = run_series(folder, ref, frames, regions, strain, *where, report)
    remove_earlier(folder, (READINGS,) if regions.columns else ())
    for name, error in done.errors[:_SHOWN]:
        warn(f"{name}: {error}")
    figures = _figures(done) | {
        "points": len(ref.xy),
        "prefilter": ref.prefilter.sigma,
        "folder": str(folder),
    }
    emit("\n".join(_lines(figures)), figures, how.as_json)


def _figures(done: SeriesOutcome) -> dict[str, Any]:
    import numpy as np

    worst = done.worst
    valid = worst and {
        "median": float(np.nanmedian(done.valid)),
        "worst": worst[1],
        "worst_frame": worst[0],
    }
    by_net = {} if done.by_net is None else {"by_net_fraction": done.by_net}
    return by_net | {
        "frames": done.frames,
        "left_out": len(done.errors),
        "valid": valid,
        "status": done.status,
        "seconds": done.seconds,
    }


def _lines(figures: dict[str, Any]) -> list[str]:
    valid = figures["valid"]
    said = [
        f"{figures['frames']} frames, {figures['left_out']} left out; {figures['seconds']:.1f} s;"
        f" written to {figures['folder']}"
    ]
    if valid:
        said.append(
            f"valid of the points in the ROI: {valid['median']:.1%} in the median frame,"
            f" {valid['worst']:.1%} in the worst, {valid['worst_frame']}"
        )
    if "by_net_fraction" in figures:
        said.append(f"{figures['by_net_fraction']:.1%} of the points measured are those of the net")
    if any(figures["status"].values()):
        said += status_lines(figures["points"], figures["status"])
    return said

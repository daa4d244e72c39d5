"""Correlate the images of a test as its page asks, into a folder of its own."""

from __future__ import annotations

from itertools import count
from pathlib import Path

from dic import export
from rig.series.measure import require_points
from rig.series.regions import regions_toml
from rig.series.run import FIELDS, PARTS, run_series
from rig.series.scale import scaled_points, two_points
from rig.series.tabulate import StrainOptions
from rig.view.asked import AskedSettings
from rig.view.job import Report
from rig.view.preview import prepared
from rig.view.viewed import SomeFrames, ViewedTest

REGIONS = "regions.toml"


def start(test: ViewedTest, asked: AskedSettings) -> None:
    """Start the correlation of all images but the reference; the page then shows its result.

    Raises
    ------
    OSError, ValueError
        The image, its ROI or the settings cannot be used, or one is running.
    """
    ref, frames, regions = prepared(test, asked), _frames(test, asked.reference), asked.regions
    require_points(ref)
    scaled = scaled_points(two_points(asked.scale, None), ref.xy) if asked.scale.strip() else None
    strain = StrainOptions(asked.window, asked.kind, scaled=scaled)

    def work(report: Report) -> Path:
        folder = _folder(test.out, saved_regions(asked))
        run_series(folder, ref, frames, regions, strain, report=report)
        return folder / FIELDS

    test.job.start(work, test.show)


def _frames(test: ViewedTest, reference: str) -> SomeFrames:
    """Return all frames but the reference, in their order."""
    if test.frames is None:
        raise ValueError("there are no images to correlate; name them with --frames")
    names = enumerate(test.frames.names)
    return SomeFrames(test.frames, tuple(n for n, name in names if name != reference))


def _folder(wanted: Path, regions: str) -> Path:
    """Make the folder of a test and write its regions; another one where there is a result.

    A test with these regions that was stopped goes on in its own.
    """
    names = (wanted.name if n == 1 else f"{wanted.name}-{n}" for n in count(1))
    folder = next(one for name in names if _is_free(one := wanted.with_name(name), regions))
    folder.mkdir(parents=True, exist_ok=True)
    with export.aside(folder / REGIONS) as draft:
        draft.write_text(regions, encoding="utf-8")
    return folder


def _is_free(folder: Path, regions: str) -> bool:
    if not folder.exists():
        return True
    if not folder.is_dir():
        return False
    text = folder / REGIONS
    stopped = (folder / PARTS).is_dir() and not (folder / FIELDS).exists()
    if stopped and text.is_file():
        return text.read_text(encoding="utf-8") == regions
    return not any(folder.iterdir())


def saved_regions(asked: AskedSettings) -> str:
    """Write the regions of a page as the TOML that `touchplate correlate` takes, with its words."""
    words = (
        f"# touchplate correlate {asked.reference} FRAMES --subset {asked.subset}"
        f" --step {asked.step} --order {asked.order} --window {asked.window}"
        f" --kind {asked.kind} --regions regions.toml"
        + (f" --scale '{asked.scale}'" if asked.scale.strip() else "")
    )
    return f"{' '.join(words.split())}\n\n{regions_toml(asked.regions)}"

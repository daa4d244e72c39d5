"""Regions of a test, changed."""

from pathlib import Path

from rig.series.regions import mask_of, read_regions, regions_toml
from rig.studies.files.kind import Kind, Wrong
from rig.studies.files.limits import out_of_range
from rig.studies.files.mutation import mutate_text

SHAPE = 480, 640
TEXT = """
[[roi]]
points = [[20, 30], [600.5, 30], [600.5, 440], [20, 440]]

[[roi]]
points = [[300, 200], [340, 200], [320, 240.25]]
hole = true

[[extensometer]]
name = "along"
start = [100, 240]
end = [500, 241.5]

[[gauge]]
name = "middle"
points = [[250, 180], [390, 180], [390, 300]]
"""


def make_regions(path: Path) -> None:
    """Write regions of all kinds."""
    path.write_text(TEXT, encoding="utf-8")


def read_changed(path: Path) -> Wrong:
    """Read regions, draw the ROI and write them again."""
    regions = read_regions(path)
    yield from out_of_range(regions.model_dump())
    mask_of(regions.roi, SHAPE)
    regions_toml(regions)


REGIONS = Kind(".toml", make_regions, mutate_text, read_changed)

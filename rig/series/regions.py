"""Regions of a test, read from TOML: the ROI, extensometers and gauges."""

from __future__ import annotations

import json
import tomllib
from collections import Counter
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from dic import export
from rig.series.invariants import STRAINS
from rig.system.arrays import Mask

_LARGEST = 20_000  # px, the largest side of an image
Coordinate = Annotated[
    float, Field(ge=-_LARGEST, le=_LARGEST, allow_inf_nan=False, description="px")
]
_Name = Annotated[str, Field(min_length=1)]
Point = tuple[Coordinate, Coordinate]

TAKEN = ("number", "frame", "time_s")
"""Columns that tables of readings have beside those of the regions."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Polygon(_Part):
    """A polygon of the ROI, or a hole in it."""

    points: Annotated[list[Point], Field(min_length=3, description="Corners (x, y), px.")]
    hole: Annotated[bool, Field(description="Pixels inside are left out.")] = False


class Extensometer(_Part):
    """Two points whose distance is followed."""

    name: _Name
    start: Annotated[Point, Field(description="(x, y), px.")]
    end: Annotated[Point, Field(description="(x, y), px.")]

    @model_validator(mode="after")
    def _has_length(self) -> Self:
        if self.start == self.end:
            raise ValueError(f"extensometer {self.name} has both ends at one point")
        return self


class Gauge(_Part):
    """A polygon over which strain is averaged."""

    name: _Name
    points: Annotated[list[Point], Field(min_length=3, description="Corners (x, y), px.")]


class Regions(_Part):
    """What a file of regions holds."""

    roi: list[Polygon] = []
    extensometer: list[Extensometer] = []
    gauge: list[Gauge] = []

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of what is read, each of which has a σ beside it."""
        lengths = (one.name for one in self.extensometer)
        fields = (*STRAINS, *export.INVARIANTS)
        return *lengths, *(f"{one.name}_{field}" for one in self.gauge for field in fields)

    @model_validator(mode="after")
    def _has_columns_of_its_own(self) -> Self:
        columns = Counter([*TAKEN, *self.columns, *(f"sigma_{name}" for name in self.columns)])
        for name, count in columns.items():
            if count > 1:
                raise ValueError(
                    "each extensometer and gauge needs a name of its own, and the column"
                    f" '{name}' of the readings is taken"
                )
        return self


def read_regions(path: Path) -> Regions:
    """Read regions from TOML.

    Raises
    ------
    OSError, ValueError
        One sentence on the file, the key and what it should be.
    """
    try:
        return Regions.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is not TOML ({error}); correct it there") from None
    except ValidationError as error:
        raise ValueError(f"{path}: {_key_or_value(error)}; correct it there") from None


def _key_or_value(error: ValidationError) -> str:
    """Return what is wrong in a file: a key that it cannot have or that it lacks, or a value."""
    from rig.scene.refusal import sentence  # a test correlates without scenes

    keys = {"extra_forbidden", "missing"} & {fault["type"] for fault in error.errors()}
    return sentence(error, Regions) if keys else first_fault(error)


def first_fault(error: ValidationError) -> str:
    """Return where the first fault is, and what it is."""
    first = error.errors()[0]
    place = ".".join(str(part) for part in first["loc"])
    ours = first["type"] == "value_error"
    message = str(first.get("ctx", {})["error"]) if ours else first["msg"].lower()
    return f"{place}: {message}" if place else message


def regions_toml(regions: Regions) -> str:
    """Write regions as the TOML that `read_regions` reads."""
    lines: list[str] = []
    for one in regions.roi:
        lines += ["[[roi]]", f"points = {_points(one.points)}"]
        lines += ["hole = true", ""] if one.hole else [""]
    for one in regions.extensometer:
        lines += ["[[extensometer]]", f"name = {json.dumps(one.name)}"]
        lines += [f"start = {_point(one.start)}", f"end = {_point(one.end)}", ""]
    for one in regions.gauge:
        lines += ["[[gauge]]", f"name = {json.dumps(one.name)}", f"points = {_points(one.points)}"]
        lines += [""]
    return "\n".join(lines)


def _points(points: list[Point]) -> str:
    return f"[{', '.join(map(_point, points))}]"


def _point(point: Point) -> str:
    return f"[{point[0]:g}, {point[1]:g}]"


def mask_of(polygons: list[Polygon], shape: tuple[int, int]) -> Mask | None:
    """Draw the ROI (H, W); None if there is no polygon.

    Raises
    ------
    ValueError
        A polygon has no pixel on the image.
    """
    if not polygons:
        return None
    inside = np.zeros(shape, np.uint8)
    if all(polygon.hole for polygon in polygons):
        inside[:] = 1
    for polygon in sorted(polygons, key=lambda p: p.hole):
        one = filled(polygon.points, shape)
        if not one.any():
            x, y = polygon.points[0]
            raise ValueError(
                f"roi polygon at ({x:g}, {y:g}) px has no pixel on the image of "
                f"{shape[1]}x{shape[0]} px; points are (x, y)"
            )
        inside[one] = 0 if polygon.hole else 1
    return inside > 0


def filled(points: list[Point], shape: tuple[int, int]) -> Mask:
    """Pixels (H, W) inside a polygon."""
    import cv2

    plane = np.zeros(shape, np.uint8)
    cv2.fillPoly(plane, [np.rint(np.array(points) * 16).astype(np.int32)], (1,), shift=4)
    return plane > 0

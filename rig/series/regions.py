"""Regions of a test, read from TOML: the ROI, extensometers and gauges, and what they read."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

import dic
from rig.scene.quantity import LARGEST_SIDE
from rig.series.scale import SCALED
from rig.system.arrays import F64, AnyArray, Mask

Coordinate = Annotated[
    float, Field(ge=-LARGEST_SIDE, le=LARGEST_SIDE, allow_inf_nan=False, description="px")
]
Point = tuple[Coordinate, Coordinate]
UV, SIGMA_UV = ("u", "v"), ("sigma_u", "sigma_v")
STRAINS = ("exx", "eyy", "exy")


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Polygon(_Part):
    """A polygon of the ROI, or a hole in it."""

    points: Annotated[list[Point], Field(min_length=3, description="Corners (x, y), px.")]
    hole: Annotated[bool, Field(description="Pixels inside are left out.")] = False


class Extensometer(_Part):
    """Two points whose distance is followed."""

    name: str
    start: Annotated[Point, Field(description="(x, y), px.")]
    end: Annotated[Point, Field(description="(x, y), px.")]

    @model_validator(mode="after")
    def _has_length(self) -> Self:
        if self.start == self.end:
            raise ValueError(f"extensometer {self.name} has both ends at one point")
        return self


class Gauge(_Part):
    """A polygon over which strain is averaged."""

    name: str
    points: Annotated[list[Point], Field(min_length=3, description="Corners (x, y), px.")]


class Regions(_Part):
    """What a file of regions holds."""

    roi: list[Polygon] = []
    extensometer: list[Extensometer] = []
    gauge: list[Gauge] = []


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
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise ValueError(f"{path}: {place}: {first['msg'].lower()}; correct it there") from None


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
        one = _filled(polygon.points, shape)
        if not one.any():
            x, y = polygon.points[0]
            raise ValueError(
                f"roi polygon at ({x:g}, {y:g}) px has no pixel on the image of "
                f"{shape[1]}x{shape[0]} px; points are (x, y)"
            )
        inside[one] = 0 if polygon.hole else 1
    return inside > 0


def _filled(points: list[Point], shape: tuple[int, int]) -> Mask:
    import cv2

    plane = np.zeros(shape, np.uint8)
    cv2.fillPoly(plane, [np.rint(np.array(points) * 16).astype(np.int32)], (1,), shift=4)
    return plane > 0


def elongation(
    one: Extensometer, grid: dic.Grid, table: Mapping[str, AnyArray], places: F64 | None = None
) -> tuple[float, float]:
    """Change of length over length of an extensometer in a frame, and its σ; NaN where lost.

    With `places` (R·C, 2) mm of the points on the object, lengths are those on the object.

    σ takes the points between which an end lies for fully correlated: an upper bound.
    """
    ends = [lay(grid, np.array([place])) for place in (one.start, one.end)]
    known = table if places is None else dict(table) | {"X": places[:, 0], "Y": places[:, 1]}
    moved, loose = (UV, SIGMA_UV) if places is None else (SCALED[:2], SCALED[2:])
    first, second = (_pair(end, known, moved) for end in ends)
    loose_1, loose_2 = (_pair(end, known, loose) for end in ends)
    if places is None:
        apart = np.array(one.end) - np.array(one.start)
    else:
        apart = _pair(ends[1], known, ("X", "Y")) - _pair(ends[0], known, ("X", "Y"))
    length = float(np.linalg.norm(apart))
    along = apart / length
    after = float(np.linalg.norm(apart + second - first))
    spread = np.sqrt(np.sum(along**2 * (loose_1**2 + loose_2**2)))
    return after / length - 1, float(spread) / length


@dataclass(frozen=True, eq=False)
class Between:
    """Places on a grid, each between four of its points; NaN is read beyond the grid.

    Attributes
    ----------
    corners : (K, 4) int64
        Numbers of the points, row by row.
    weights : (K, 4) float64
        Of their values.
    """

    corners: NDArray[np.int64]
    weights: F64

    def read(self, values: AnyArray) -> F64:
        """Read a field (R·C,) or (R, C) at the places, (K,)."""
        cut = np.asarray(values, dtype=np.float64).ravel()[self.corners]
        return np.sum(np.where(self.weights == 0, 0, self.weights * cut), axis=1)

    def nearest(self) -> Between:
        """Return the nearest point of each place alone."""
        weights = np.where(np.isnan(self.weights), np.nan, 0.0)
        rows, last = np.arange(len(weights)), np.argmax(self.weights, axis=1)
        weights[rows, last] = np.where(np.isnan(self.weights[:, 0]), np.nan, 1.0)
        return Between(self.corners, weights)


def lay(grid: dic.Grid, places: F64) -> Between:
    """Find the points of a grid about places (K, 2) px."""
    rows, columns = grid.shape
    x = (places[:, 0] - grid.xs[0]) / grid.step
    y = (places[:, 1] - grid.ys[0]) / grid.step
    i = np.clip(np.floor(x), 0, max(columns - 2, 0)).astype(np.int64)
    j = np.clip(np.floor(y), 0, max(rows - 2, 0)).astype(np.int64)
    s, t = x - i, y - j
    right, below = np.minimum(i + 1, columns - 1), np.minimum(j + 1, rows - 1)
    corners = [row * columns + column for row in (j, below) for column in (i, right)]
    weights = np.stack([(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t], axis=1)
    outside = (x < 0) | (y < 0) | (x > columns - 1) | (y > rows - 1)
    weights[outside] = np.nan
    return Between(np.stack(corners, axis=1), weights)


def _pair(between: Between, table: Mapping[str, AnyArray], names: tuple[str, ...]) -> F64:
    return np.array([between.read(table[name])[0] for name in names])


def gauge_strain(
    one: Gauge, grid: dic.Grid, table: Mapping[str, AnyArray], vsg: float
) -> dict[str, tuple[float, float]]:
    """Mean strain of the points inside a gauge, and its σ; NaN where there is none.

    Strains nearer than `vsg` px share their pixels: there are as many independent ones as squares
    of that side, and one at least.
    """
    corners = np.array(one.points)
    size = np.ceil(corners.max(axis=0)).astype(int) + 1
    shape = max(size[1], int(grid.ys[-1]) + 1), max(size[0], int(grid.xs[-1]) + 1)
    inside = _filled(one.points, (int(shape[0]), int(shape[1])))
    here: Mask = inside[np.asarray(grid.ys, np.int64)][:, np.asarray(grid.xs, np.int64)].ravel()
    found: dict[str, tuple[float, float]] = {}
    for name in STRAINS:
        values, spread = table[name][here], table[f"sigma_{name}"][here]
        known = np.isfinite(values) & np.isfinite(spread)
        if not known.any():
            found[name] = np.nan, np.nan
            continue
        free = max(np.count_nonzero(known) * grid.step**2 / vsg**2, 1.0)
        found[name] = (
            float(values[known].mean(dtype=np.float64)),
            float(np.sqrt(np.mean(np.square(spread[known], dtype=np.float64)) / free)),
        )
    return found

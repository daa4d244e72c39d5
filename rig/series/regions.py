"""Regions of a test, read from TOML: the ROI, extensometers and gauges, and what they read."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

import dic
from rig.system.arrays import F64, AnyArray, Mask

Point = tuple[float, float]


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
    one: Extensometer, grid: dic.Grid, table: dict[str, AnyArray]
) -> tuple[float, float]:
    """Change of length over length of an extensometer in a frame, and its σ; NaN where lost.

    σ takes the points between which an end lies for fully correlated: an upper bound.
    """
    start, end = np.array(one.start), np.array(one.end)
    (first, loose), (second, slack) = (_motion(place, grid, table) for place in (start, end))
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    after = float(np.linalg.norm(end + second - start - first))
    spread = np.sqrt(np.sum(along**2 * (loose**2 + slack**2)))
    return after / length - 1, float(spread) / length


def _motion(place: F64, grid: dic.Grid, table: dict[str, AnyArray]) -> tuple[F64, F64]:
    """Displacement (2,) px at a place between four points, and its σ; NaN beyond the grid."""
    x, y = (place[0] - grid.xs[0]) / grid.step, (place[1] - grid.ys[0]) / grid.step
    i, j = int(np.floor(x)), int(np.floor(y))
    rows, columns = grid.shape
    i, j = i - (i == columns - 1 and x == i), j - (j == rows - 1 and y == j)
    if not (0 <= i < columns - 1 and 0 <= j < rows - 1):
        return np.full(2, np.nan), np.full(2, np.nan)
    s, t = x - i, y - j
    weights = np.array([[(1 - s) * (1 - t), s * (1 - t)], [(1 - s) * t, s * t]])
    cut = [table[n].reshape(grid.shape)[j : j + 2, i : i + 2] for n in ("u", "v")]
    loose = [table[n].reshape(grid.shape)[j : j + 2, i : i + 2] for n in ("sigma_u", "sigma_v")]
    return (
        np.array([np.sum(weights * part) for part in cut], dtype=np.float64),
        np.array([np.sum(weights * part) for part in loose], dtype=np.float64),
    )


def gauge_strain(
    one: Gauge, grid: dic.Grid, table: dict[str, AnyArray], vsg: float
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
    for name in ("exx", "eyy", "exy"):
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

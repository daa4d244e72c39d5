"""Fields drawn over the grey reference: one alone, or several on one sheet.

Drawn by Pillow, pixel by pixel: a library for charts takes longer to load than a pair to correlate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from PIL import Image, ImageDraw

from dic.arrays import F32, F64, U8, AnyArray, Mask
from dic.fields.displacement import DisplacementField, Status
from dic.fields.grid import Grid
from dic.plots import axes
from dic.plots.axes import SheetBox

_STATUS_COLOURS = (
    "#2f9e44", "#ced4da", "#f1c40f", "#343a40", "#f783ac", "#4dabf7", "#e03131", "#7048e8",
    "#8c5a2b", "#22b8cf", "#f76707", "#94d82d",
)  # fmt: skip
_BLUE_TO_RED = (
    "#053061", "#2166ac", "#4393c3", "#92c5de", "#d1e5f0", "#f7f7f7", "#fddbc7", "#f4a582",
    "#d6604d", "#b2182b", "#67001f",
)  # fmt: skip
_OPACITY = 0.75
_ALONE, _ON_SHEET = (900, 700), (400, 400)  # px that the image of one panel may take
_ACROSS = 3  # panels a row of a sheet
_DOT = 4  # px, radius of a point that is on no grid


@dataclass(frozen=True)
class _Style:
    title: str
    unit: str
    scale: float  # the field is multiplied by this
    colours: str  # perceptually uniform; one that diverges for what has a sign


_STYLES = {
    "u": _Style("Displacement u, to the right", "px", 1, "viridis"),
    "v": _Style("Displacement v, downwards", "px", 1, "viridis"),
    "exx": _Style("Strain exx", "µε", 1e6, "diverging"),
    "eyy": _Style("Strain eyy", "µε", 1e6, "diverging"),
    "exy": _Style("Shear strain exy (tensor)", "µε", 1e6, "diverging"),
    "sigma_u": _Style("Standard deviation of u", "px", 1, "magma"),
    "sigma_v": _Style("Standard deviation of v", "px", 1, "magma"),
    "sigma_exx": _Style("Standard deviation of exx", "µε", 1e6, "magma"),
    "sigma_eyy": _Style("Standard deviation of eyy", "µε", 1e6, "magma"),
    "sigma_exy": _Style("Standard deviation of exy", "µε", 1e6, "magma"),
    "u_mm": _Style("Displacement along x", "mm", 1, "viridis"),
    "v_mm": _Style("Displacement along y", "mm", 1, "viridis"),
    "principal_1": _Style("First principal strain", "µε", 1e6, "diverging"),
    "principal_2": _Style("Second principal strain", "µε", 1e6, "diverging"),
    "principal_angle": _Style("Angle of the first principal strain", "°", 180 / np.pi, "viridis"),
    "max_shear": _Style("Largest shear in the plane", "µε", 1e6, "viridis"),
    "von_mises": _Style("Equivalent strain of von Mises", "µε", 1e6, "viridis"),
    "zncc": _Style("Correlation ZNCC", "1", 1, "cividis"),
    "status": _Style("Status", "", 1, "status"),
}


@dataclass(frozen=True, eq=False)
class FieldStyle:
    """How a field is drawn.

    Attributes
    ----------
    title, unit : str
    factor : float
        Values are multiplied by this to be in the unit.
    colours : (K, 3) uint8
        RGB from the lowest value to the highest; one a status for "status".
    """

    title: str
    unit: str
    factor: float
    colours: U8


def field_style(name: str) -> FieldStyle:
    """Return how a field is drawn, by its name."""
    style = _style(name)
    return FieldStyle(style.title, style.unit, style.scale, _colours(style.colours))


def draw(path: Path, image: AnyArray, name: str, values: AnyArray, disp: DisplacementField) -> None:
    """Draw the field `values` (N,) called `name` over `image` (H, W) into a PNG at `path`."""
    sheet, boxes = _frame(image.shape, _ALONE, (1, 1))
    _panel(sheet, boxes[0], image, name, values, disp)
    sheet.save(path, compress_level=1)


def draw_sheet(
    path: Path, image: AnyArray, fields: Mapping[str, AnyArray], disp: DisplacementField
) -> None:
    """Draw fields (N,) by name over `image` (H, W), three a row, into one PNG at `path`."""
    rows = -(-len(fields) // _ACROSS)
    sheet, boxes = _frame(image.shape, _ON_SHEET, (rows, _ACROSS))
    for box, (name, values) in zip(boxes, fields.items(), strict=False):
        _panel(sheet, box, image, name, values, disp)
    sheet.save(path, compress_level=1)


def paint(
    image: AnyArray,
    name: str,
    values: AnyArray,
    grid: Grid,
    limits: tuple[float, float],
    caption: str,
) -> U8:
    """Draw the field `values` (N,) of a grid within `limits`, (high, wide, 3) RGB.

    `limits` are those of `colour_limits`; `caption` stands behind the title.
    """
    sheet, boxes = _frame(image.shape, _ALONE, (1, 1))
    style = _style(name)
    titled = replace(style, title=f"{style.title} · {caption}" if caption else style.title)
    _panel_in(sheet, boxes[0], image, titled, values, (grid, grid.xy), limits)
    return np.asarray(sheet, dtype=np.uint8)


def colour_limits(name: str, values: AnyArray) -> tuple[float, float]:
    """Limits of the colours of a field, in the unit in which it is drawn."""
    style = _style(name)
    if style.colours == "status":
        return 0.0, float(len(_STATUS_COLOURS))
    return _limits(values * style.scale, style.colours)


def _style(name: str) -> _Style:
    """How a field is drawn; one of an unknown name by its name."""
    if name in _STYLES:
        return _STYLES[name]
    if name.startswith("sigma_"):
        of = _style(name.removeprefix("sigma_"))
        words = f"{of.title[0].lower()}{of.title[1:]}".split(",")[0]
        return _Style(f"Standard deviation of {words}", of.unit, of.scale, "magma")
    return _Style(name.replace("_", " "), "", 1, "viridis")


def _frame(
    shape: tuple[int, ...], room: tuple[int, int], counts: tuple[int, int]
) -> tuple[Image.Image, list[SheetBox]]:
    """White sheet with room for rows and columns of images (H, W) and what stands about each."""
    height, width = shape
    scale = min(room[0] / width, room[1] / height)
    wide, high = max(round(width * scale), 1), max(round(height * scale), 1)
    across, up = wide + axes.LEFT + axes.RIGHT, high + axes.BELOW + axes.ABOVE
    boxes = [
        SheetBox(column * across + axes.LEFT, row * up + axes.ABOVE, wide, high)
        for row in range(counts[0])
        for column in range(counts[1])
    ]
    return Image.new("RGB", (counts[1] * across, counts[0] * up), "white"), boxes


def _panel(
    sheet: Image.Image,
    box: SheetBox,
    image: AnyArray,
    name: str,
    values: AnyArray,
    disp: DisplacementField,
) -> None:
    """Draw a field over the image on its own scale."""
    limits = colour_limits(name, values)
    _panel_in(sheet, box, image, _style(name), values, (disp.grid, disp.xy), limits)


def _panel_in(
    sheet: Image.Image,
    box: SheetBox,
    image: AnyArray,
    style: _Style,
    values: AnyArray,
    points: tuple[Grid | None, F64],
    limits: tuple[float, float],
) -> None:
    """Draw a field over the image, the axes about it and its scale beside it."""
    colours, values, known = _colours(style.colours), values * style.scale, np.isfinite(values)
    grid, xy = points
    height = np.where(known, (values - limits[0]) / (limits[1] - limits[0]), 0)
    shades = colours[np.clip(height * len(colours), 0, len(colours) - 1).astype(int)]
    grey = _grey(image, box)
    if grid is None:
        pixels = _dots(grey, shades, known, image.shape, xy)
    else:
        pixels = _cells(grey, shades, known, image.shape, grid)
    sheet.paste(Image.fromarray(pixels), (box.left, box.top))
    pen = ImageDraw.Draw(sheet)
    axes.draw_axes(pen, box, image.shape, style.title)
    faded = np.rint(_OPACITY * colours + (1 - _OPACITY) * 255).astype(np.uint8)
    if style.colours == "status":
        axes.draw_legend(pen, box, faded, _counted(values[known]))
    else:
        axes.draw_scale(sheet, box, faded, limits, style.unit)


def _counted(values: AnyArray) -> list[str]:
    """Name of each status, and how many points have it."""
    counts = np.bincount(values.astype(int), minlength=len(Status))
    return [f"{s.name.lower().replace('_', ' ')} ({counts[s]})" for s in Status]


@cache
def _colours(name: str) -> U8:
    """Colours (K, 3) from the lowest value to the highest."""
    if name == "status":
        return _table(_STATUS_COLOURS)
    if name == "diverging":
        known = _table(_BLUE_TO_RED)
        at = np.linspace(0, len(known) - 1, 256)
        each: list[F64] = [np.interp(at, np.arange(len(known)), channel) for channel in known.T]
        return np.rint(each).astype(np.uint8).T
    levels = np.arange(256, dtype=np.uint8)[:, None]
    blue_first = cv2.applyColorMap(levels, getattr(cv2, f"COLORMAP_{name.upper()}"))
    return np.asarray(blue_first[:, 0, ::-1], dtype=np.uint8)


def _table(names: tuple[str, ...]) -> U8:
    return np.array([list(bytes.fromhex(name[1:])) for name in names], dtype=np.uint8)


def _limits(values: AnyArray, colours: str) -> tuple[float, float]:
    """Limits that a few wild points do not move; symmetric where the colours diverge."""
    known = values[np.isfinite(values)]
    if len(known) == 0:
        return 0.0, 1.0
    low, high = (float(limit) for limit in np.percentile(known, (1, 99)))
    if colours == "diverging":
        high = max(abs(low), abs(high))
        low = -high
    return (low, high) if high - low > 1e-9 * max(abs(low), abs(high)) else (low - 0.5, high + 0.5)


def _sampled(count: int, pixels: int) -> F64:
    """Place in a line of `count` pixels, px, that each of `pixels` on the sheet shows."""
    return (np.arange(pixels) + 0.5) * count / pixels - 0.5


def _grey(image: AnyArray, box: SheetBox) -> F32:
    """Image as it stands in its box, (high, wide, 1), from black 0 to white 255."""
    dark, bright = np.percentile(image[::4, ::4], (1, 99))
    rows, columns = (
        np.rint(_sampled(count, pixels)).astype(int)
        for count, pixels in zip(image.shape, (box.high, box.wide), strict=True)
    )
    light = (image[rows[:, None], columns].astype(np.float32) - dark) / max(bright - dark, 1e-12)
    return np.float32(255) * np.clip(light, 0, 1).astype(np.float32)[..., None]


def _cells(grey: F32, shades: U8, known: Mask, shape: tuple[int, ...], grid: Grid) -> U8:
    """Lay the colours (N, 3) of a grid as cells over the grey (high, wide, 1)."""
    rows, columns = (
        np.rint((_sampled(count, pixels) - line[0]) / grid.step).astype(int)
        for count, pixels, line in zip(shape, grey.shape, (grid.ys, grid.xs), strict=False)
    )
    row, column = (
        np.clip(line, 0, n - 1) for line, n in zip((rows, columns), grid.shape, strict=True)
    )
    places = row[:, None] * grid.shape[1] + column
    drawn = (row == rows)[:, None] & (column == columns) & known[places]
    opacity = np.where(drawn, np.float32(_OPACITY), np.float32(0))[..., None]
    return np.rint(grey + opacity * (shades[places] - grey)).astype(np.uint8)


def _dots(grey: F32, shades: U8, known: Mask, shape: tuple[int, ...], xy: AnyArray) -> U8:
    """Draw the colours (N, 3) of scattered points as dots with a white rim over the grey."""
    pixels = np.repeat(np.rint(grey).astype(np.uint8), 3, axis=2)
    scale = np.array(grey.shape[1::-1]) / shape[::-1]
    for (x, y), shade in zip((xy[known] + 0.5) * scale, shades[known], strict=True):
        middle = int(x), int(y)
        cv2.circle(pixels, middle, _DOT + 1, (255, 255, 255), cv2.FILLED, cv2.LINE_AA)
        cv2.circle(pixels, middle, _DOT, shade.tolist(), cv2.FILLED, cv2.LINE_AA)
    return pixels

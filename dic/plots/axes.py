"""What stands about an image on a sheet: axes, numbers, title, and a scale or a legend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from dic.arrays import U8

LEFT, RIGHT, BELOW, ABOVE = 75, 190, 60, 40
"""Room for it about each image, px."""

_BESIDE, _WIDE, _TIP = 20, 18, 16  # px: from image to scale, and its width and pointed ends
_MARK, _GAP = 5, 8  # px: length of a tick, and how far from the line its number stands
_APART, _STACKED = 50, 35  # px: what a number takes of a line across, and of one upwards
_MAX_TICKS = 8  # on a line
_NAMES = 30, 62  # px from the image to the names of its axes, below and to the left
_SMALL, _MIDDLE, _LARGE = 11, 14, 17  # px, sizes of letters


@dataclass(frozen=True)
class SheetBox:
    """Place of an image on the sheet, px."""

    left: int
    top: int
    wide: int
    high: int


def draw_axes(pen: ImageDraw.ImageDraw, box: SheetBox, shape: tuple[int, ...], title: str) -> None:
    """Draw the frame of an image (H, W), px along its sides, and its title."""
    right, bottom = box.left + box.wide, box.top + box.high
    pen.rectangle((box.left - 1, box.top - 1, right, bottom), outline="black")
    middle = box.left + box.wide / 2
    pen.text((middle, box.top - _GAP - 3), title, "black", _font(_LARGE), anchor="ms")
    for value, number in _ticks(-0.5, shape[1] - 0.5, box.wide / _APART):
        x = box.left + (value + 0.5) * box.wide / shape[1]
        pen.line((x, bottom, x, bottom + _MARK), "black")
        pen.text((x, bottom + _GAP), number, "black", _font(_MIDDLE), anchor="mt")
    for value, number in _ticks(-0.5, shape[0] - 0.5, box.high / _STACKED):
        y = box.top + (value + 0.5) * box.high / shape[0]
        pen.line((box.left - 1 - _MARK, y, box.left - 1, y), "black")
        pen.text((box.left - 1 - _GAP, y), number, "black", _font(_MIDDLE), anchor="rm")
    pen.text((middle, bottom + _NAMES[0]), "x, px", "black", _font(_MIDDLE), anchor="mt")
    _upward(pen, (box.left - _NAMES[1], box.top + box.high / 2), "y, px")


def draw_scale(
    sheet: Image.Image,
    box: SheetBox,
    colours: U8,
    limits: tuple[float, float],
    unit: str,
) -> None:
    """Draw the colours from the lower limit to the upper; the tips are what lies beyond."""
    pen = ImageDraw.Draw(sheet)
    left, right = box.left + box.wide + _BESIDE, box.left + box.wide + _BESIDE + _WIDE
    top, bottom = box.top + _TIP, box.top + box.high - _TIP
    middle, long = (left + right) / 2, max(bottom - top, 1)
    places = (len(colours) * (1 - (np.arange(long) + 0.5) / long)).astype(int)
    strip = np.repeat(colours[places][:, None], _WIDE, axis=1)
    upper, lower = (middle, box.top), (middle, box.top + box.high)
    pen.polygon([(left, top), upper, (right, top)], fill=tuple(colours[-1].tolist()))
    pen.polygon([(left, bottom), lower, (right, bottom)], fill=tuple(colours[0].tolist()))
    sheet.paste(Image.fromarray(strip), (left, top))
    corners = [(left, top), upper, (right, top), (right, bottom), lower, (left, bottom)]
    pen.line([*corners, corners[0]], "black")
    widest = 0.0
    for value, number in _ticks(*limits, long / _STACKED):
        y = bottom - (value - limits[0]) / (limits[1] - limits[0]) * long
        pen.line((right, y, right + _MARK, y), "black")
        pen.text((right + _GAP, y), number, "black", _font(_MIDDLE), anchor="lm")
        widest = max(widest, _font(_MIDDLE).getlength(number))
    _upward(pen, (right + _GAP + widest + 8, box.top + box.high / 2), unit)


def draw_legend(
    pen: ImageDraw.ImageDraw, box: SheetBox, colours: U8, labels: Sequence[str]
) -> None:
    """Draw a field of each colour with its label, the first below."""
    left, right = box.left + box.wide + _BESIDE, box.left + box.wide + _BESIDE + _WIDE
    edges = box.top + box.high * (1 - np.arange(len(labels) + 1) / len(labels))
    for label, colour, lower, upper in zip(labels, colours, edges, edges[1:], strict=False):
        pen.rectangle((left, upper, right, lower), tuple(colour.tolist()), "black")
        place = right + _GAP, (upper + lower) / 2
        pen.text(place, label, "black", _font(_SMALL), anchor="lm")


def _ticks(low: float, high: float, room: float) -> list[tuple[float, str]]:
    """Round numbers between two limits, no more than have room, and each as it is written."""
    smallest = (high - low) / np.clip(room, 1, _MAX_TICKS)
    power = int(np.floor(np.log10(smallest)))
    step = next(m for m in (1, 2, 5, 10) if m * 10.0**power >= smallest) * 10.0**power
    places = max(0, -int(np.floor(np.log10(step) + 1e-9)))
    written = f".{places}f" if places < 10 else ".4g"
    values = [n * step for n in range(int(np.ceil(low / step)), int(np.floor(high / step)) + 1)]
    return [(value, f"{value:{written}}".replace("-", "−")) for value in values]


def _upward(pen: ImageDraw.ImageDraw, place: tuple[float, float], text: str) -> None:
    """Write a text upwards; `place` is the middle of its left side."""
    font = ImageFont.TransposedFont(_font(_MIDDLE), Image.Transpose.ROTATE_90)
    pen.text((place[0], place[1] - _font(_MIDDLE).getlength(text) / 2), text, "black", font)


@cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    """DejaVu Sans, which comes with Matplotlib, found without loading that."""
    home = find_spec("matplotlib")
    if home is None or home.origin is None:
        raise OSError("the font of plots comes with matplotlib; install that")
    return ImageFont.truetype(Path(home.origin).parent / "mpl-data/fonts/ttf/DejaVuSans.ttf", size)

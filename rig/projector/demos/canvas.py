"""Light over the plate, drawn in mm: soft, dim and on black, then laid into the projector's image.

The light falls on the speckle that is measured, so the rule of `rig.projector.markers` holds here:
nothing is brighter than a quarter of full light, and no edge is hard.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from rig.projector.markers import PEAK, SUBPIXEL, Screen
from rig.system.arrays import F32, F64, Grey

Colour = tuple[float, float, float]
Place = tuple[float, float]

FINE = 3.0  # px a mm of what has lines and letters,
SMOOTH = 1.0  # and of what has none
LONGEST = 1024  # px of a canvas
SOFT = 0.35  # mm, one standard deviation of the softest edge that a letter can have
WHITE: Colour = (1.0, 1.0, 1.0)
GREY: Colour = (0.55, 0.6, 0.66)
FINGERS: tuple[Colour, ...] = (
    (0.34, 0.71, 0.91),
    (0.95, 0.65, 0.10),
    (0.20, 0.75, 0.55),
    (0.95, 0.90, 0.35),
    (0.90, 0.55, 0.75),
    (0.95, 0.45, 0.15),
)
"""Hues of Okabe and Ito (2008), which the colour-blind tell apart, of like brightness."""


def colour_of(identity: int | None) -> Colour:
    """Return the colour of a finger."""
    return FINGERS[(identity or 0) % len(FINGERS)]


@dataclass(frozen=True, eq=False)
class Canvas:
    """An image that covers the plate, its top at the plate's largest y.

    Attributes
    ----------
    plate_size : (a, b), mm
    scale : float
        px a mm.
    image : (H, W, 3) uint8
        RGB, 0 to 255; full light is 255 here.
    """

    plate_size: tuple[float, float]
    scale: float
    image: Grey

    def px(self, place: Place) -> tuple[float, float]:
        """Where a place (x, y), mm, lies, px."""
        return place[0] * self.scale - 0.5, (self.plate_size[1] - place[1]) * self.scale - 0.5

    @property
    def T_plate_px(self) -> F64:  # noqa: N802
        """Homography from this image, px, to the plate, mm."""
        step = 1.0 / self.scale
        top = self.plate_size[1] - 0.5 * step
        return np.array([[step, 0.0, 0.5 * step], [0.0, -step, top], [0.0, 0.0, 1.0]])

    def places(self) -> tuple[F32, F32]:
        """X (W,) of its columns and y (H,) of its rows, mm, float32."""
        height, width = self.image.shape[:2]
        x = (np.arange(width, dtype=np.float32) + 0.5) / self.scale
        y = self.plate_size[1] - (np.arange(height, dtype=np.float32) + 0.5) / self.scale
        return x, y


def blank(plate_size: tuple[float, float], scale: float = FINE) -> Canvas:
    """Return a dark canvas of `scale` px a mm, coarser for a plate that is very large."""
    scale = min(scale, LONGEST / max(plate_size))
    width, height = (max(round(side * scale), 1) for side in plate_size)
    return Canvas(plate_size, scale, np.zeros((height, width, 3), np.uint8))


def line(on: Canvas, places: Sequence[Place], width: float, colour: Colour, light: float) -> None:
    """Draw a line of `width` mm through places, mm; `light` is 0 to 1."""
    points = np.rint(np.array([on.px(place) for place in places]) * 2**SUBPIXEL).astype(np.int32)
    thick = max(round(width * on.scale), 1)
    cv2.polylines(on.image, [points], False, _rgb(colour, light), thick, cv2.LINE_AA, SUBPIXEL)


def disc(on: Canvas, place: Place, radius: float, colour: Colour, light: float) -> None:
    """Fill a circle of `radius` mm."""
    centre, reach = _fixed(on.px(place)), round(radius * on.scale * 2**SUBPIXEL)
    cv2.circle(on.image, centre, reach, _rgb(colour, light), -1, cv2.LINE_AA, SUBPIXEL)


def ring(on: Canvas, place: Place, radius: float, width: float, colour: Colour, light: float):
    """Draw a circle of `radius` and a line of `width`, mm."""
    centre, reach = _fixed(on.px(place)), round(radius * on.scale * 2**SUBPIXEL)
    thick = max(round(width * on.scale), 1)
    cv2.circle(on.image, centre, reach, _rgb(colour, light), thick, cv2.LINE_AA, SUBPIXEL)


def box(on: Canvas, low: Place, high: Place, colour: Colour, light: float) -> None:
    """Fill the rectangle between two of its corners, mm; nothing where it has no area."""
    (left, bottom), (right, top) = on.px(low), on.px(high)
    if right <= left or bottom <= top:
        return
    rows, columns = slice(round(top), round(bottom) + 1), slice(round(left), round(right) + 1)
    on.image[rows, columns] = _rgb(colour, light)


def write(on: Canvas, words: str, middle: Place, tall: float, colour: Colour, light: float) -> None:
    """Write words about a place, mm; `tall` is the size of the type, mm, and shrinks to fit."""
    size = max(round(tall * on.scale), 4)
    letters = _letters(words, size)
    room = on.image.shape[1]
    if letters.shape[1] > room:
        letters = _letters(words, max(int(size * room / letters.shape[1]), 4))
    height, width = letters.shape
    x, y = on.px(middle)
    left, top = round(x - width / 2), round(y - height / 2)
    rows = slice(max(top, 0), max(min(top + height, on.image.shape[0]), 0))
    columns = slice(max(left, 0), max(min(left + width, room), 0))
    part = letters[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
    shown = part[..., None] * (np.array(_rgb(colour, light)) / 255.0)
    np.maximum(on.image[rows, columns], shown.astype(np.uint8), out=on.image[rows, columns])


def laid(on: Canvas, screen: Screen, soft: float = SOFT) -> Grey:
    """Soften a canvas by `soft` mm, dim it and lay it over the plate in the projector's image.

    Returns
    -------
    (H, W, 3) uint8 RGB, nowhere brighter than `PEAK`.
    """
    light = on.image
    if soft > 0:
        light = cv2.GaussianBlur(light, (0, 0), max(soft * on.scale, 0.5))
    dim = cv2.convertScaleAbs(light, alpha=PEAK / 255.0)
    T = screen.T_px_plate @ on.T_plate_px
    return np.asarray(cv2.warpPerspective(dim, T, screen.size), np.uint8)


@lru_cache(maxsize=64)
def _letters(words: str, size: int) -> Grey:
    """Words in the type that Pillow brings, (H, W) uint8."""
    from PIL import Image, ImageDraw, ImageFont

    font = ImageFont.load_default(size)
    left, top, right, bottom = (round(edge) for edge in font.getbbox(words or " "))
    image = Image.new("L", (max(right - left, 1), max(bottom - top, 1)))
    ImageDraw.Draw(image).text((-left, -top), words, fill=255, font=font)
    return np.asarray(image, np.uint8)


def _rgb(colour: Colour, light: float) -> Colour:
    red, green, blue = (255.0 * light * part for part in colour)
    return red, green, blue


def _fixed(place: tuple[float, float]) -> tuple[int, int]:
    x, y = (round(part * 2**SUBPIXEL) for part in place)
    return x, y

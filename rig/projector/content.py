"""What the projector can show: marks, a demo, an image, a stripe of the Gray code, plain light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.live.snapshot import Mark
from rig.projector.demos.demo import Demo
from rig.projector.demos.keys import Keys
from rig.projector.demos.painting import Painting
from rig.projector.demos.ripples import Ripples
from rig.projector.demos.trails import Trails
from rig.projector.demos.weighing import Weighing
from rig.projector.gray_code import pattern
from rig.projector.markers import Screen, draw_marks

MANY = 200  # marks: a pipe holds their message, so that no window that stands still holds the loop


@dataclass(frozen=True)
class Stripe:
    """Image of the Gray code by its number, see `rig.projector.gray_code.pattern`."""

    number: int


@dataclass(frozen=True)
class Plain:
    """Even light of a grey level, 0 to 255."""

    level: int


@dataclass(frozen=True, eq=False)
class Image:
    """An image of a program, (H, W, 3) uint8 RGB, as large as the projector's; see `image_of`."""

    pixels: NDArray[np.uint8]


Content = tuple[Mark, ...] | Demo | Image | Stripe | Plain
"""Small but for an image, so that it passes to the window's process at once and is drawn there."""


def marks_of(given: Sequence[object]) -> tuple[Mark, ...]:
    """Take the marks of a program.

    Raises
    ------
    ValueError
        If something else is among them, or they are more than `MANY`.
    """
    marks = tuple(one for one in given if isinstance(one, Mark))
    others = [type(one).__name__ for one in given if not isinstance(one, Mark)]
    if others:
        raise ValueError(
            f"projector content holds a {others[0]}; give marks, such as frame.touches, or an image"
            " as an array of uint8"
        )
    if len(marks) > MANY:
        raise ValueError(
            f"projector content is {len(marks)} marks, and {MANY} are shown at the most; draw an"
            " image"
        )
    return marks


def image_of(pixels: NDArray[np.uint8], size: tuple[int, int]) -> Image:
    """Take an image as it is now, whatever becomes of its array.

    Parameters
    ----------
    pixels : (H, W) or (H, W, 3) uint8
        Grey, or red, green and blue.
    size : (int, int)
        Width and height of the projector's image, px.

    Raises
    ------
    ValueError
        If it is no such array, or of another size.
    """
    width, height = size
    if pixels.dtype != np.uint8 or pixels.shape not in ((height, width), (height, width, 3)):
        shape = " x ".join(map(str, pixels.shape))
        raise ValueError(
            f"projector image is an array of {shape} {pixels.dtype}; give uint8 of {height} x"
            f" {width} (grey) or {height} x {width} x 3 (RGB), as projector.size is {width} x"
            f" {height} px"
        )
    grey = pixels[..., None] if pixels.ndim == 2 else pixels
    return Image(np.array(np.broadcast_to(grey, (height, width, 3))))


def draw(content: Content, screen: Screen) -> NDArray[np.uint8]:
    """Draw the projector's image, (H, W, 3) uint8 RGB."""
    width, height = screen.size
    match content:
        case Stripe(number):
            return np.repeat(pattern(screen.size, number)[..., None], 3, axis=2)
        case Image(pixels):
            return pixels
        case Plain(level):
            return np.full((height, width, 3), level, np.uint8)
        case Ripples() | Trails() | Weighing() | Painting() | Keys() as demo:
            return demo.drawn(screen)
        case marks:
            return draw_marks(marks, screen)

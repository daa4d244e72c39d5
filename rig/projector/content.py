"""What the projector can show: marks of touches, a demo, a stripe of the Gray code, plain light."""

from __future__ import annotations

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


@dataclass(frozen=True)
class Stripe:
    """Image of the Gray code by its number, see `rig.projector.gray_code.pattern`."""

    number: int


@dataclass(frozen=True)
class Plain:
    """Even light of a grey level, 0 to 255."""

    level: int


Content = tuple[Mark, ...] | Demo | Stripe | Plain
"""Small, so that it passes to the window's process at once; the image is drawn there."""


def draw(content: Content, screen: Screen) -> NDArray[np.uint8]:
    """Draw the projector's image, (H, W, 3) uint8 RGB."""
    width, height = screen.size
    match content:
        case Stripe(number):
            return np.repeat(pattern(screen.size, number)[..., None], 3, axis=2)
        case Plain(level):
            return np.full((height, width, 3), level, np.uint8)
        case Ripples() | Trails() | Weighing() | Painting() | Keys() as demo:
            return demo.drawn(screen)
        case marks:
            return draw_marks(marks, screen)

"""Keys of a piano on the plate: the one that sounds is lit, as far up as it is loud."""

from __future__ import annotations

from dataclasses import dataclass, replace

from rig.projector.demos.canvas import (
    FINGERS,
    GREY,
    WHITE,
    Canvas,
    Place,
    blank,
    box,
    laid,
    line,
    write,
)
from rig.projector.demos.keyboard import Key, lay_keys
from rig.projector.demos.moment import Moment
from rig.projector.demos.notes import LOUDEST, Playing
from rig.projector.markers import Screen
from rig.system.arrays import Grey

EDGE = 0.8  # mm, between keys
OUTLINE, BLACK, QUIET = 0.4, 0.15, 0.25  # light of an outline, a black key, what is not loud
LABEL = 0.28  # of a key's width, the size of its name


@dataclass(frozen=True)
class Keys:
    """The keyboard and who plays on it."""

    plate_size: tuple[float, float]
    playing: Playing

    def after(self, moment: Moment) -> Keys:
        """Go on to the next frame."""
        playing, _ = self.playing.after(moment.touches, moment.time)
        return replace(self, playing=playing)

    def tared(self) -> Keys:
        """Lift all fingers."""
        return begin_keys(self.plate_size)

    def drawn(self, screen: Screen) -> Grey:
        """Draw the keys; the white ones first, as the black ones lie on them."""
        on, lit = blank(self.plate_size), self.playing.lit()
        keys = self.playing.keyboard.keys
        whites, blacks = ([key for key in keys if key.black == black] for black in (False, True))
        for row in (whites, blacks):
            for key in row:
                box(on, key.low, key.high, WHITE, 0.0)
                _light(on, key, lit.get(key.pitch, 0))
            for key in row:
                _outline(on, key)
        return laid(on, screen)

    def __eq__(self, other: object) -> bool:
        """Whether the same is shown."""
        return (
            isinstance(other, Keys)
            and self.plate_size == other.plate_size
            and self.playing.lit() == other.playing.lit()
        )

    def __hash__(self) -> int:
        """Agree with equality."""
        return hash(tuple(sorted(self.playing.lit().items())))


def begin_keys(plate_size: tuple[float, float]) -> Keys:
    """Lay the keys of a plate; nobody plays."""
    return Keys(plate_size, Playing(lay_keys(plate_size)))


def _light(on: Canvas, key: Key, velocity: int) -> None:
    """Light a key that sounds, up to its velocity."""
    low, high = _inside(key)
    if key.black:
        box(on, low, high, GREY, BLACK)
    if velocity:
        colour = FINGERS[1] if key.black else FINGERS[0]
        top = low[1] + velocity / LOUDEST * (high[1] - low[1])
        box(on, low, high, colour, QUIET)
        box(on, low, (high[0], top), colour, 1.0)
        line(on, ((low[0], top), (high[0], top)), 1.2, WHITE, 1.0)


def _outline(on: Canvas, key: Key) -> None:
    (x0, y0), (x1, y1) = key.low, key.high
    line(on, ((x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)), EDGE, GREY, OUTLINE)
    if not key.black and key.pitch % 12 == 0:
        tall = LABEL * (x1 - x0)
        write(on, f"C{key.pitch // 12 - 1}", ((x0 + x1) / 2, y0 - tall), tall, GREY, 1.0)


def _inside(key: Key) -> tuple[Place, Place]:
    """Corners of what lies within the outline of a key."""
    (x0, y0), (x1, y1) = key.low, key.high
    return (x0 + EDGE, y0 + EDGE), (x1 - EDGE, y1 - EDGE)

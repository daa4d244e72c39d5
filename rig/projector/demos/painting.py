"""Force-painting: a finger is a brush, broader and brighter the harder it presses.

The plate keeps what is painted until it is tared. Only the dabs go to the window, some 50 kB at
most, so that the link takes them at once; what was drawn of the first of them is kept there.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import hypot
from typing import NamedTuple

import numpy as np

from rig.live.snapshot import Mark
from rig.projector.demos.canvas import FINGERS, WHITE, Canvas, blank, laid, ring
from rig.projector.demos.moment import Moment
from rig.projector.markers import Screen
from rig.system.arrays import F32, Grey

BRUSH, BROADEST = 4.5, 12.0  # mm, radius of 1 N, and of any force
EDGE = 0.35  # of the radius, over which a dab falls off
COVERS = 0.8  # of what lies under it
DENSE, CLOSEST = 0.3, 0.3  # of the radius, and mm at least, from one dab to the next
LEAP = 25.0  # mm from frame to frame that are no stroke
MANY = 2600  # dabs of 20 bytes: they fit a link of 64 kB; beyond, the first are gone
GONE = 200  # of them at a time
SCALE = 1.5  # px a mm of the paint


class Dab(NamedTuple):
    """One dab: place and radius, mm, light from 0 to 1, and the number of its colour."""

    x: float
    y: float
    radius: float
    light: float
    colour: int


@dataclass(frozen=True, eq=False)
class Painting:
    """All that was painted, and the brushes.

    Attributes
    ----------
    plate_size : (a, b), mm
    dabs : (N, 5) float32
        As `Dab` says, the oldest first.
    touches : tuple of Mark
        The fingers that paint now.
    ends : tuple of (identity, Dab)
        Where each of them has painted last.
    """

    plate_size: tuple[float, float]
    dabs: F32 = field(default_factory=lambda: np.empty((0, 5), np.float32))
    touches: tuple[Mark, ...] = ()
    ends: tuple[tuple[int, Dab], ...] = ()

    def __eq__(self, other: object) -> bool:
        """Whether the same is shown."""
        return (
            isinstance(other, Painting)
            and self.touches == other.touches
            and np.array_equal(self.dabs, other.dabs)
        )

    def __hash__(self) -> int:
        """Agree with equality."""
        return hash((self.touches, self.dabs.tobytes()))

    def after(self, moment: Moment) -> Painting:
        """Go on to the next frame: paint from where each finger was to where it is."""
        before, ends = dict(self.ends), dict[int, Dab]()
        new: list[Dab] = []
        for mark in moment.touches:
            name = mark.identity or 0
            stroke = _stroke(before.get(name), _dab_of(mark))
            new += stroke
            ends[name] = stroke[-1] if stroke else before[name]
        dabs = np.concatenate([self.dabs, np.array(new, np.float32)]) if new else self.dabs
        if len(dabs) > MANY:
            dabs = dabs[len(dabs) - MANY + GONE :]
        return replace(self, dabs=dabs, touches=moment.touches, ends=tuple(ends.items()))

    def tared(self) -> Painting:
        """Wipe the plate."""
        return Painting(self.plate_size, touches=self.touches)  # each finger begins anew

    def drawn(self, screen: Screen) -> Grey:
        """Draw the paint, and a ring about each brush."""
        paint = painted(self.plate_size, self.dabs)
        on = Canvas(paint.plate_size, paint.scale, paint.image.copy())
        for mark in self.touches:
            ring(on, (mark.x, mark.y), radius_of(mark.force) + 1.5, 0.7, WHITE, 0.9)
        return laid(on, screen)


def radius_of(force: float) -> float:
    """Radius of a brush that presses with `force` N, mm."""
    return float(min(BRUSH * np.sqrt(max(force, 0.0)), BROADEST))


def painted(plate_size: tuple[float, float], dabs: F32) -> Canvas:
    """Lay dabs (N, 5) over each other, the last on top."""
    known = _last_of(plate_size)
    laid_before, image = known.pop() if known else (dabs[:0], blank(plate_size, SCALE).image)
    count = len(laid_before)
    if count > len(dabs) or not np.array_equal(laid_before, dabs[:count]):
        count, image = 0, blank(plate_size, SCALE).image
    on = Canvas(plate_size, blank_scale(plate_size), image)
    for dab in dabs[count:].tolist():
        _lay(on, Dab(*dab))
    known.append((dabs, image))
    return on


def blank_scale(plate_size: tuple[float, float]) -> float:
    """Return the px a mm of the paint on a plate."""
    return blank(plate_size, SCALE).scale


@lru_cache(maxsize=2)
def _last_of(plate_size: tuple[float, float]) -> list[tuple[F32, Grey]]:
    """Keep what was painted last on a plate, dabs and image: a painting goes on from there."""
    return []


def _dab_of(mark: Mark) -> Dab:
    radius = radius_of(mark.force)
    light = 0.5 + 0.5 * radius / BROADEST
    return Dab(mark.x, mark.y, radius, light, (mark.identity or 0) % len(FINGERS))


def _stroke(before: Dab | None, now: Dab) -> list[Dab]:
    """Dabs from the last one of a finger on, at most as far as it is; none where it rests."""
    if before is None or hypot(now.x - before.x, now.y - before.y) > LEAP:
        return [now]
    far = max(hypot(now.x - before.x, now.y - before.y), abs(now.radius - before.radius))
    count = int(far / max(DENSE * now.radius, CLOSEST))
    steps = np.linspace(before[:3], now[:3], count + 1)[1:]
    return [Dab(x, y, radius, *now[3:]) for x, y, radius in steps.tolist()]


def _lay(on: Canvas, dab: Dab) -> None:
    """Lay one dab over what is there."""
    left, top = on.px((dab.x, dab.y))
    reach = dab.radius * on.scale
    height, width = on.image.shape[:2]
    x0, x1 = max(int(left - reach), 0), min(int(left + reach) + 2, width)
    y0, y1 = max(int(top - reach), 0), min(int(top + reach) + 2, height)
    if x0 >= x1 or y0 >= y1 or reach <= 0:
        return
    away = np.hypot(np.arange(x0, x1) - left, (np.arange(y0, y1) - top)[:, None]) / reach
    cover = COVERS * np.clip((1.0 - away) / EDGE, 0.0, 1.0)[..., None]
    part = on.image[y0:y1, x0:x1]
    paint = 255.0 * dab.light * np.array(FINGERS[int(dab.colour)])
    part[:] = np.rint(part + cover * (paint - part)).astype(np.uint8)

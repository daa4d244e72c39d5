"""Trails: each finger draws light behind it, wider the harder it presses, that fades."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rig.projector.demos.canvas import WHITE, blank, colour_of, disc, laid, line
from rig.projector.demos.moment import Moment
from rig.projector.markers import Screen
from rig.system.arrays import Grey

LAST = 1.8  # s that light stays
TAIL = 0.35  # of its width at the end of a trail
BROAD = 4.0  # mm, of the trail of 1 N; area grows with force
WIDEST = 12.0  # mm
APART = 0.2  # s without a finger after which its trail ends, and another begins


class Passed(NamedTuple):
    """Where a finger was, mm, when, s, and how hard, N."""

    time: float
    x: float
    y: float
    force: float


Trail = tuple[int, tuple[Passed, ...]]
"""A finger and where it passed, the oldest first."""


@dataclass(frozen=True)
class Trails:
    """The last seconds of all fingers.

    Attributes
    ----------
    plate_size : (a, b), mm
    time : float, s
    trails : tuple of (identity, places)
    """

    plate_size: tuple[float, float]
    time: float = 0.0
    trails: tuple[Trail, ...] = ()

    def after(self, moment: Moment) -> Trails:
        """Go on to the next frame."""
        kept = dict(self.trails)
        for mark in moment.touches:
            name = mark.identity or 0
            here = Passed(moment.time, mark.x, mark.y, max(mark.force, 0.0))
            kept[name] = (*kept.get(name, ()), here)
        alive = {
            name: tuple(one for one in passed if moment.time - one.time <= LAST)
            for name, passed in kept.items()
        }
        trails = tuple((name, passed) for name, passed in alive.items() if passed)
        return replace(self, time=moment.time, trails=trails)

    def tared(self) -> Trails:
        """Leave the plate dark."""
        return Trails(self.plate_size, self.time)

    def drawn(self, screen: Screen) -> Grey:
        """Draw what is old first, so that a trail crosses over itself."""
        on = blank(self.plate_size)
        if not self.trails:
            return laid(on, screen)
        parts = [
            (before, after, name) for name, way in self.trails for before, after in pairwise(way)
        ]
        for before, after, name in sorted(parts, key=lambda part: part[1].time):
            if after.time - before.time > APART:
                continue
            fresh = 1.0 - (self.time - after.time) / LAST
            width = broad(after.force) * (TAIL + (1 - TAIL) * fresh)
            line(on, (before[1:3], after[1:3]), width, colour_of(name), fresh**1.5)
        for name, passed in self.trails:
            head = passed[-1]
            if head.time == self.time:
                disc(on, head[1:3], 0.75 * broad(head.force), colour_of(name), 1.0)
                disc(on, head[1:3], 0.35 * broad(head.force), WHITE, 1.0)
        return laid(on, screen, 0.7)


def broad(force: float) -> float:
    """Width of the trail of a force, N, in mm."""
    return float(min(BROAD * np.sqrt(force), WIDEST))

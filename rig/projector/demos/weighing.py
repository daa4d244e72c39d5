"""A weighing scale: what lies on the plate in newton, with its σ, or that it cannot say."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, floor, isfinite, log10
from textwrap import wrap

import numpy as np

from rig.live.snapshot import Mark
from rig.projector.demos.canvas import (
    FINGERS,
    GREY,
    WHITE,
    Canvas,
    blank,
    box,
    laid,
    line,
    write,
)
from rig.projector.demos.moment import NO_LOAD, Load, Moment
from rig.projector.markers import Screen
from rig.system.arrays import Grey

STEADY = 0.7  # s over which a load that rests is averaged
OTHER = 4.0  # σ of a difference, by which a load is another one
CANNOT_SAY = "cannot say"
SETTING, NUMBER, WORDS = 0.2, 0.8, 0.8  # light of what always stands there, and of what it says
FILLED, BAND, POINTER = 0.6, 0.9, 1.0  # of the dial


@dataclass(frozen=True)
class Weighing:
    """What the scale has seen of the load that rests on it.

    Attributes
    ----------
    plate_size : (a, b), mm
    full : float, N
        End of its dial.
    loads : tuple of (float, Load)
        Times, s, and loads of the last frames, as long as they are one and the same load.
    zero : Load
        What it takes for nothing.
    touches : tuple of Mark
    """

    plate_size: tuple[float, float]
    full: float
    loads: tuple[tuple[float, Load], ...] = ()
    zero: Load = NO_LOAD
    touches: tuple[Mark, ...] = ()

    def after(self, moment: Moment) -> Weighing:
        """Go on to the next frame."""
        load = moment.load
        kept = [each for each in self.loads if moment.time - each[0] <= STEADY]
        if load.reason or (kept and _another(self.mean, load)):
            kept = []
        loads = (*kept, (moment.time, load))
        return replace(self, loads=loads, touches=moment.touches)

    def tared(self) -> Weighing:
        """Take what lies on it now for nothing; what cannot be weighed leaves the zero as it is."""
        mean = self.mean
        return self if mean.reason else replace(self, zero=mean)

    @property
    def mean(self) -> Load:
        """Mean of the frames; σ is that of one frame, for what it shares with the next stays."""
        if not self.loads:
            return NO_LOAD
        loads = [load for _, load in self.loads]
        reason = loads[-1].reason
        force, sigma = (float(np.mean([getattr(one, name) for one in loads])) for name in _NUMBERS)
        return Load(force, sigma, reason)

    @property
    def net(self) -> Load:
        """What it says."""
        return self.mean.above(self.zero)

    @property
    def empty(self) -> bool:
        """Whether no touch was found, of which no σ is known: too weak a one is not seen."""
        return not self.mean.reason and self.mean.sigma == 0.0

    @property
    def lines(self) -> tuple[str, str]:
        """What it says, in two lines."""
        net = self.net
        if net.reason:
            return CANNOT_SAY, net.reason
        if self.empty and self.zero.sigma == 0.0:
            return "0 N", "nothing is felt"
        places = decimals(net.sigma)
        plus = f"± {net.sigma:.{places}f} N" + (" net" if self.zero != NO_LOAD else "")
        return f"{net.force:.{places}f} N", plus

    def drawn(self, screen: Screen) -> Grey:
        """Draw the number, its σ or why there is none, and a dial.

        The words stand in the half of the plate where less lies: their light on what is measured
        there would move it.
        """
        a, b = self.plate_size
        on, tall = blank(self.plate_size), min(self.plate_size)
        upper = sum(mark.force * (mark.y - b / 2) for mark in self.touches) <= 0
        middle = (0.84 if upper else 0.36) * b
        number, beneath = self.lines
        known = not self.net.reason
        write(on, number, (a / 2, middle), 0.13 * tall, FINGERS[0 if known else 1], NUMBER)
        size = (0.065 if known else 0.045) * tall
        for row, words in enumerate(wrap(beneath, 36)):
            place = a / 2, middle - 0.115 * b - 1.3 * size * row
            write(on, words, place, size, GREY, WORDS)
        self._dial(on)
        return laid(on, screen)

    def _dial(self, on: Canvas) -> None:
        """Draw a dial from 0 to its end, its pointer, and 2σ as a band about it."""
        a, b = self.plate_size
        low, wide, foot, high = 0.12 * a, 0.76 * a, 0.12 * b, 0.03 * b
        step = _step(self.full)
        for tick in np.arange(0.0, self.full + step / 2, step).tolist():
            x = low + wide * min(tick / self.full, 1.0)
            line(on, ((x, foot - 0.3 * high), (x, foot - 0.9 * high)), 0.5, GREY, 0.6)
            write(on, f"{tick:g}", (x, foot - 1.9 * high), 0.036 * min(a, b), GREY, 0.8)
        box(on, (low, foot), (low + wide, foot + high), GREY, SETTING)
        net = self.net
        if net.reason or not isfinite(net.force):
            return
        at, early, late = (
            low + wide * float(np.clip(force / self.full, 0.0, 1.0))
            for force in (net.force, net.force - 2 * net.sigma, net.force + 2 * net.sigma)
        )
        box(on, (low, foot), (at, foot + high), FINGERS[0], FILLED)
        box(on, (early, foot + 0.3 * high), (late, foot + 0.7 * high), FINGERS[1], BAND)
        line(on, ((at, foot - 0.1 * high), (at, foot + 1.1 * high)), 1.0, WHITE, POINTER)


_NUMBERS = ("force", "sigma")


def decimals(sigma: float) -> int:
    """Digits after the point of a number: one of its σ that counts, two where that is a 1."""
    if not (isfinite(sigma) and sigma > 0.0):
        return 2
    first = floor(log10(sigma))
    return min(max(int(sigma < 2 * 10.0**first) - first, 0), 3)


def _another(mean: Load, load: Load) -> bool:
    """Whether a load is not the one that was there."""
    return not abs(load.force - mean.force) <= OTHER * max(load.sigma, mean.sigma, 1e-9)


def _step(full: float) -> float:
    """Force from tick to tick of a dial, N: 1, 2 or 5 of a power of ten, five ticks or more."""
    power = 10.0 ** floor(log10(full / 4))
    return next(power * of for of in (5.0, 2.0, 1.0) if ceil(full / (power * of)) >= 4)

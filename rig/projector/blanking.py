"""Marks that are shown only while no frame is measured: the window blinks, lit frames are left out.

Camera and projector run free of one another, so a frame counts as dark only if nothing can have
been lit from before its exposure began until after it ended.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import monotonic
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.system.frame import Frame, Source

SLACK = 0.005  # s by which a display may be late or early


@dataclass(frozen=True)
class Blink:
    """When the projector is lit, on the monotonic clock that all processes share; s."""

    period: float = 0.15
    lit: float = 0.05

    def on(self, time: float) -> bool:
        """Whether marks are shown at a time."""
        return time % self.period < self.lit

    def until_change(self, time: float) -> float:
        """Time until light comes or goes, s."""
        phase = time % self.period
        return (self.lit if phase < self.lit else self.period) - phase

    def dark(self, start: float, end: float) -> bool:
        """Whether no mark is shown from `start` to `end`."""
        phase = start % self.period
        return phase >= self.lit and phase + end - start <= self.period


class Blanked:
    """A `rig.system.frame.Source` that leaves out frames which may show the projector's light.

    Parameters
    ----------
    source : Source
    blink : Blink
    delay : float, s
        From the command to the light.
    exposure : float, s
        At most; a frame interval where it is not known.
    """

    def __init__(self, source: Source, blink: Blink, delay: float, exposure: float):
        self._source, self._blink = source, blink
        self._delay, self._exposure = delay, exposure
        self._left_out = 0

    @property
    def status(self) -> str:
        """See `Source.status`."""
        return self._source.status

    def grab(self, timeout: float) -> Frame | None:
        """See `Source.grab`; frames that are left out have no number, for they are not lost."""
        end = monotonic() + timeout
        while frame := self._source.grab(max(0.0, end - monotonic())):
            last = frame.captured - self._delay
            if self._blink.dark(last - self._exposure - SLACK, last + SLACK):
                return replace(frame, sequence=frame.sequence - self._left_out)
            self._left_out += 1
        return None

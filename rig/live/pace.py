"""How many frames a loop took, how fast, how many it never saw, and whether they came in order."""

from __future__ import annotations

from collections import deque
from typing import Any

from rig.live.snapshot import Sign
from rig.system.timing import Stopwatch

RUNNING = 60  # frames over which the running rate is measured
JUDGED = 15  # frames from which on the rate of the source is one
OTHER_RATE = 0.2  # of the rate that the scene names
LATENCY = "capture to touches"


class Pace:
    """Counts the frames of a loop.

    Parameters
    ----------
    rate : float or None, frames a second
        What the scene expects of the source; None where it says nothing.

    Attributes
    ----------
    frames, dropped : int
        Frames that were finished, and those that the source numbered and the loop never saw.
    out_of_order : int
        Frames that came after one of their number or of a later one.
    """

    def __init__(self, rate: float | None = None) -> None:
        self.frames = self.dropped = self.out_of_order = 0
        self._rate = rate
        self._sequence: int | None = None
        self._first: float | None = None
        self._taken: deque[tuple[int, float]] = deque(maxlen=RUNNING)
        self._finished: deque[float] = deque(maxlen=RUNNING)

    @property
    def fps(self) -> float:
        """Frames a second that are finished now; 0 before the second."""
        if len(self._finished) < 2:
            return 0.0
        return (len(self._finished) - 1) / (self._finished[-1] - self._finished[0])

    @property
    def mean_fps(self) -> float | None:
        """Frames a second from the first to the last; None before the second."""
        if self._first is None or self.frames < 2:
            return None
        return (self.frames - 1) / (self._finished[-1] - self._first)

    @property
    def source_rate(self) -> float | None:
        """Frames a second that the source numbers now; None before it can be said."""
        if len(self._taken) < JUDGED:
            return None
        (first, began), (last, ended) = self._taken[0], self._taken[-1]
        return (last - first) / (ended - began) if ended > began else None

    @property
    def signs(self) -> tuple[Sign, ...]:
        """Whether the frames come at the rate of the scene, and in their order."""
        signs: list[Sign] = []
        found, expected = self.source_rate, self._rate
        if found is not None and expected is not None:
            differs = abs(found / expected - 1.0) > OTHER_RATE
            signs.append(Sign("camera rate", f"{found:.3g} of {expected:g} fps", differs))
        if self.out_of_order:
            signs.append(Sign("out of order", f"{self.out_of_order} frames", True))
        return tuple(signs)

    def begin(self, sequence: int, captured: float) -> None:
        """Count what was dropped before a frame, captured at a time, s."""
        if self._sequence is None or sequence > self._sequence:
            self.dropped += 0 if self._sequence is None else sequence - self._sequence - 1
            self._sequence = sequence
            self._taken.append((sequence, captured))
            return
        self.out_of_order += 1
        if sequence < self._sequence:
            # It was taken for dropped.
            self.dropped = max(0, self.dropped - 1)

    def finish(self, time: float) -> None:
        """Count a frame that was finished at a time, s."""
        self.frames += 1
        self._first = time if self._first is None else self._first
        self._finished.append(time)

    def summary(self, watch: Stopwatch) -> dict[str, Any]:
        """Figures of the run so far, with the times of its stages, ready for JSON."""
        median, late = watch.quantiles(LATENCY)
        return {
            "frames": self.frames,
            "dropped": self.dropped,
            "out_of_order": self.out_of_order,
            "fps": self.mean_fps,
            "latency_ms": {"median": median, "p95": late},
            "stages_ms": {
                name: {"median": middle, "p95": slow}
                for name, middle, slow in watch.table()
                if name != LATENCY
            },
        }

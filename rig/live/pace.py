"""How many frames a loop took, how fast, and how many came that it never saw."""

from __future__ import annotations

from collections import deque
from typing import Any

from rig.system.timing import Stopwatch

RUNNING = 60  # frames over which the running rate is measured
LATENCY = "capture to touches"


class Pace:
    """Counts the frames of a loop.

    Attributes
    ----------
    frames, dropped : int
        Frames that were finished, and those that the source numbered and the loop never saw.
    """

    def __init__(self) -> None:
        self.frames = self.dropped = 0
        self._sequence: int | None = None
        self._first: float | None = None
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

    def begin(self, sequence: int) -> None:
        """Count what was dropped before a frame."""
        if self._sequence is not None:
            self.dropped += sequence - self._sequence - 1
        self._sequence = sequence

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
            "fps": self.mean_fps,
            "latency_ms": {"median": median, "p95": late},
            "stages_ms": {
                name: {"median": middle, "p95": slow}
                for name, middle, slow in watch.table()
                if name != LATENCY
            },
        }

"""What the projector was given, and when."""

from __future__ import annotations

from collections import deque

from rig.snapshot import Mark

KEPT = 60  # pictures that are remembered: two seconds


class Shown:
    """A log of marks and the times from which on they are shown."""

    def __init__(self) -> None:
        self._log: deque[tuple[float, tuple[Mark, ...]]] = deque(maxlen=KEPT)

    def add(self, time: float, marks: tuple[Mark, ...]) -> None:
        """Note marks that are shown from `time` (s) on."""
        self._log.append((time, marks))

    def at(self, time: float) -> tuple[Mark, ...]:
        """Return the marks that were shown at a time."""
        for since, marks in reversed(self._log):
            if since <= time:
                return marks
        return ()

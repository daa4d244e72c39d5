"""What the projector was given, and when."""

from __future__ import annotations

from collections import deque

from rig.projector.content import Content

KEPT = 60  # images that are remembered: two seconds


class DisplayLog:
    """A log of contents and the times from which on they are shown."""

    def __init__(self) -> None:
        self._log: deque[tuple[float, Content]] = deque(maxlen=KEPT)

    def add(self, time: float, content: Content) -> None:
        """Note what is shown from `time` (s) on."""
        self._log.append((time, content))

    def at(self, time: float) -> Content:
        """Return what was shown at a time."""
        for since, content in reversed(self._log):
            if since <= time:
                return content
        return ()

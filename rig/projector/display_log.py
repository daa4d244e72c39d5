"""What the projector was given, and when."""

from __future__ import annotations

from collections import deque

from rig.projector.content import Content

KEPT = 1.0  # s that contents are remembered: no frame that is older is looked at any more


class DisplayLog:
    """A log of contents and the times from which on they are shown."""

    def __init__(self) -> None:
        self._log: deque[tuple[float, Content]] = deque()

    def __len__(self) -> int:
        """Contents that are remembered."""
        return len(self._log)

    def add(self, time: float, content: Content) -> None:
        """Note what is shown from `time` (s) on, and forget what was shown before `KEPT`."""
        self._log.append((time, content))
        while len(self._log) > 1 and self._log[1][0] <= time - KEPT:
            self._log.popleft()

    def at(self, time: float) -> Content:
        """Return what was shown at a time."""
        for since, content in reversed(self._log):
            if since <= time:
                return content
        return ()

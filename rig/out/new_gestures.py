"""Gestures once each: a snapshot has those of the last second, another program wants the new."""

from __future__ import annotations

from rig.live.gestures import Gesture
from rig.live.snapshot import Snapshot


class NewGestures:
    """Call it with each snapshot: gives the gestures that the one before had not."""

    def __init__(self) -> None:
        self._last: tuple[Gesture, ...] = ()

    def __call__(self, snapshot: Snapshot) -> tuple[Gesture, ...]:
        """Give the new gestures of a frame, in their order."""
        last, self._last = self._last, snapshot.gestures
        return tuple(gesture for gesture in snapshot.gestures if gesture not in last)

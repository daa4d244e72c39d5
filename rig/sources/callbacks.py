"""Functions of a program that are called with each frame of the live loop."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.live.snapshot import Snapshot

LOG = logging.getLogger("touchplate")
Callback = Callable[["Snapshot"], object]


class Callbacks:
    """Call it with each snapshot: it calls all others, in the order in which they were added.

    One that throws is logged once, with its name and traceback, and called again with the next.
    """

    def __init__(self) -> None:
        self._all: list[Callback] = []
        self._logged: list[Callback] = []

    def add(self, callback: Callback) -> None:
        """Call this as well."""
        self._all.append(callback)

    def __call__(self, snapshot: Snapshot) -> None:
        """Call all with a snapshot."""
        for callback in tuple(self._all):
            try:
                callback(snapshot)
            except Exception as error:  # noqa: BLE001 - whatever a program does, frames go on
                self._log(callback, snapshot, error)

    def _log(self, callback: Callback, snapshot: Snapshot, error: Exception) -> None:
        if callback in self._logged:
            return
        self._logged.append(callback)
        LOG.error(
            "callback '%s' failed in frame %d (%s: %s); frames go on, and it is not said again",
            getattr(callback, "__qualname__", repr(callback)),
            snapshot.sequence,
            type(error).__name__,
            error,
            exc_info=error,
        )

"""A recording as a source: the same images once more through the loop, at their pace."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from rig.recording.session import Session, frame
from rig.system.frame import Frame


class Playback:
    """A `rig.system.frame.Source` on a session; a frame that comes late keeps its turn.

    The clock of a recording is over: the first frame counts as captured when it is given, the
    others as long after it as they were.
    """

    stored = True

    def __init__(self, session: Session):
        self._session = session
        self._next = 0
        self._captured = session.columns()["frames/captured"] if session.frames else np.empty(0)
        self._ahead: float | None = None  # of the clock of then, s
        self.status = f"recording '{session.path}' gives no frames"

    def grab(self, timeout: float) -> Frame | None:
        """See `Source.grab`."""
        if self._next == self._session.frames:
            raise EOFError(f"recording '{self._session.path}' ends after {self._next} frames")
        then, now = float(self._captured[self._next]), time.monotonic()
        self._ahead = now - then if self._ahead is None else self._ahead
        wait = then + self._ahead - now
        time.sleep(min(max(wait, 0.0), timeout))
        if wait > timeout:
            return None
        recorded = frame(self._session.row(self._next))
        self._next += 1
        captured = then + self._ahead
        return replace(recorded, captured=captured, late=time.monotonic() - captured)

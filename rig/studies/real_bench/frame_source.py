"""Frames that are photographed as they are asked for, as a source of the live loop."""

from __future__ import annotations

from collections.abc import Iterator

from rig.system.frame import Frame


class FrameSource:
    """Frames one after the other, each at its own time.

    Parameters
    ----------
    frames : iterator of Frame
    status : str
        What they show.

    Attributes
    ----------
    now : float, s
        Time of the last frame.
    """

    def __init__(self, frames: Iterator[Frame], status: str):
        self.now, self.status, self._frames = 0.0, status, frames

    def grab(self, timeout: float) -> Frame | None:
        """See `Source.grab`."""
        del timeout  # a frame is always there
        frame = next(self._frames, None)
        if frame is None:
            raise EOFError(f"{self.status}: over")
        self.now = frame.captured
        return frame

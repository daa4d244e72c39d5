"""A stage for the loop: frames by their number, and work that takes some of their time."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any

import numpy as np

import fe
from rig.on_base.shapes import list_shapes
from rig.system.arrays import AnyArray
from rig.system.frame import Frame

RATE = 10.0
"""Frames a second."""

TAKES = 6.0
"""Seconds, for which what is worked out in the background takes on a core of its own."""


class Later:
    """Works at once, and gives the result some seconds of the frames' time later."""

    def __init__(self, clock: Callable[[], float], listing: bool):
        self._clock, self._listing = clock, listing

    def __call__(self, work: Callable[[], Any]) -> Future[Any]:
        """See `rig.on_base.background.Background`."""
        if isinstance(work, partial) and work.func is list_shapes and not self._listing:
            return Future()
        awaited = _Awaited(self._clock)
        try:
            awaited.set_result(work())
        except ValueError as error:
            awaited.set_exception(error)
        return awaited


class _Awaited(Future[Any]):
    """A result that is there some seconds after it was asked for."""

    def __init__(self, clock: Callable[[], float]):
        super().__init__()
        self._clock, self._begun = clock, clock()

    def done(self) -> bool:
        """Whether its time has come."""
        return self._clock() >= self._begun + TAKES


class Stage:
    """A source that shows one plate after the other, a frame every tenth of a second.

    Parameters
    ----------
    frame : callable
        Gives image and truth of a frame by its number.
    """

    status = "the stage is over"

    def __init__(self, frame: Callable[[int], tuple[AnyArray, tuple[fe.Touch, ...]] | None]):
        self.time, self._frame, self._number = 0.0, frame, 0

    def grab(self, timeout: float) -> Frame | None:
        """See `rig.system.frame.Source`."""
        taken = self._frame(self._number)
        if taken is None:
            raise EOFError(self.status)
        self.time, self._number = self._number / RATE, self._number + 1
        return Frame(self._number, self.time, np.asarray(taken[0], np.uint8), taken[1])

"""The next shape, which is found and prepared in the background."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from enum import Enum

from models import Surface
from rig.on_base.background import Background
from rig.on_base.shapes import ReadyShape


class Way(Enum):
    """How a shape is come by."""

    SEARCH = "in an image of which nothing or little is known"
    FOLLOW = "from one near by, as far as its base has moved"


class Preparation:
    """Has one shape at a time prepared.

    Parameters
    ----------
    background : callable
        Does what takes seconds; see `Background`.
    clock : callable
        Monotonic time, s.

    Attributes
    ----------
    taken : list of float, s
        How long each took.
    trouble : str
        Why the last one is none, as a sentence; empty where it is one.
    """

    def __init__(self, background: Background, clock: Callable[[], float]):
        self.taken: list[float] = []
        self.trouble = ""
        self._background, self._clock = background, clock
        self._job: Future[ReadyShape | None] | None = None
        self._way, self._begun = Way.SEARCH, 0.0

    @property
    def busy(self) -> bool:
        """Whether one is on its way."""
        return self._job is not None

    @property
    def lead(self) -> float:
        """How long the next one may take, s; 0 where nobody knows."""
        return self.taken[-1] if self.taken else 0.0

    def start(self, way: Way, work: Callable[[], ReadyShape | None]) -> None:
        """Begin, unless one is on its way."""
        if self._job is None:
            self._way, self._begun = way, self._clock()
            self._job = self._background(work)

    def forget(self) -> None:
        """Leave what is on its way."""
        self._job = None

    def take(self) -> tuple[Way, ReadyShape] | None:
        """Give the shape that became ready, once; None while there is none."""
        if self._job is None or not self._job.done():
            return None
        job, self._job, self.trouble = self._job, None, ""
        try:
            ready = job.result()
        except ValueError as error:
            self.trouble = str(error)
            return None
        if ready is None:
            self.trouble = Surface.NO_FIT.value
            return None
        self.taken.append(self._clock() - self._begun)
        return self._way, ready

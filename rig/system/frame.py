"""Where images come from: one protocol for everything that delivers frames."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TypeVar, runtime_checkable

if TYPE_CHECKING:  # a camera must not wait for plates
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    import fe


HELD = 0.07  # s: the time of two frames, so that what is shown is younger than a tenth of a second


@dataclass(frozen=True, eq=False)
class Frame:
    """One image.

    Attributes
    ----------
    sequence : int
        Number that the source gave it; a gap is a frame that was lost.
    captured : float, s
        When it was complete, on the monotonic clock; that of an image that is stored keeps its
        distance from the first, however late it is read.
    image : (H, W) uint8
    truth : tuple of fe.Touch, or None where the source cannot know.
    late : float, s
        By which an image that is stored was read later.
    """

    sequence: int
    captured: float
    image: NDArray[np.uint8]
    truth: tuple[fe.Touch, ...] | None = None
    late: float = 0.0

    @property
    def given(self) -> float:
        """When the loop could have it, s: its latency counts from here."""
        return self.captured + self.late


class Captured(Protocol):
    """Whatever has the time of its capture, s."""

    @property
    def captured(self) -> float: ...  # noqa: D102


AnyCaptured = TypeVar("AnyCaptured", bound=Captured)


def take_next(waiting: deque[AnyCaptured], now: float) -> AnyCaptured:
    """Take the frame to go on with out of those that wait, the oldest of them first.

    So a loop that was held up for a moment loses none. Where the oldest has waited for more than
    `HELD` s the loop does not keep up: then it is the newest, and the others are lost.
    """
    if now - waiting[0].captured <= HELD:
        return waiting.popleft()
    newest = waiting.pop()
    waiting.clear()
    return newest


class Source(Protocol):
    """A camera or what stands for one.

    Attributes
    ----------
    status : str
        One sentence for the user: how it is, or why no frames come.
    """

    @property
    def status(self) -> str: ...  # noqa: D102

    def grab(self, timeout: float) -> Frame | None:
        """Next frame, waiting `timeout` s for one that was not grabbed yet; None if none came.

        A source of live frames gives each, unless the loop does not keep up; see `take_next`.

        Raises
        ------
        EOFError
            If the source has an end and it was reached; its text is a sentence for the user.
        """
        ...


@runtime_checkable
class Stored(Protocol):
    """A source of images that are stored: each is given, whenever the loop asks for it."""

    stored: bool


@runtime_checkable
class Waiting(Protocol):
    """A source whose plate stands still until it hears that the reference was taken."""

    def begin(self) -> None:
        """Let the plate be touched from now on."""
        ...


@runtime_checkable
class Bending(Protocol):
    """A source whose plate is flat until it hears that the flat one was taken."""

    def bend(self) -> None:
        """Let the base bend from now on; nothing touches it before `Waiting.begin`."""
        ...


@runtime_checkable
class Preparing(Protocol):
    """A source that has much to compute before its first frame."""

    def prepare(self, report: Callable[[int, int], None]) -> None:
        """Wait until it is ready; `report` is called with how many of how many steps are done."""
        ...

"""The setup on a page."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from time import monotonic

from rig.page.server import Publisher
from rig.page.setup_packet import SetupPacket
from rig.page.setup_view import StepLine, StepView
from rig.setup.desk import WISHES, Wish, wish_of
from rig.system.frame import Frame

PAGE = "setup.html"
PACE = 0.08  # s from one image to the next: a page that is drawn more often takes from the camera


class PageDesk:
    """See `Desk`.

    Parameters
    ----------
    publisher : Publisher
    clock : callable
        Monotonic time, s.
    """

    def __init__(self, publisher: Publisher, clock: Callable[[], float] = monotonic):
        self._publisher = publisher
        publisher.takes = WISHES
        self._clock, self._since = clock, 0.0
        self._steps: tuple[StepLine, ...] = ()
        self._shown: tuple[StepView, Frame | None] | None = None

    def enter(self, steps: tuple[StepLine, ...]) -> None:
        """See `Desk`."""
        self._steps, self._shown = steps, None

    def show(self, view: StepView, frame: Frame | None) -> None:
        """See `Desk`; of images that come fast not all are sent, of what is said everything."""
        if self._shown is not None and not self._is_news(view, frame, *self._shown):
            return
        self._shown, self._since = (view, frame), self._clock()
        image = None if frame is None else frame.image
        self._publisher.packets.put(SetupPacket(view, self._steps, image))

    def _is_news(
        self, view: StepView, frame: Frame | None, shown: StepView, image: Frame | None
    ) -> bool:
        return view != shown or (frame is not image and self._clock() - self._since >= PACE)

    def wishes(self) -> Iterator[Wish]:
        """See `Desk`."""
        for asked in self._publisher.asked():
            if (wish := wish_of(asked)) is not None:
                yield wish

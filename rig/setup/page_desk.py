"""The setup on a page."""

from __future__ import annotations

from collections.abc import Iterator

from rig.page.server import Publisher
from rig.page.setup_packet import SetupPacket
from rig.page.setup_view import StepLine, StepView
from rig.setup.desk import Wish, wish_of
from rig.system.frame import Frame

PAGE = "setup.html"


class PageDesk:
    """See `Desk`.

    Parameters
    ----------
    publisher : Publisher
    """

    def __init__(self, publisher: Publisher):
        self._publisher = publisher
        self._steps: tuple[StepLine, ...] = ()
        self._shown: tuple[StepView, Frame | None] | None = None

    def enter(self, steps: tuple[StepLine, ...]) -> None:
        """See `Desk`."""
        self._steps, self._shown = steps, None

    def show(self, view: StepView, frame: Frame | None) -> None:
        """See `Desk`; what is shown already is not sent again."""
        if self._shown is not None and (view, frame) == self._shown:
            return
        self._shown = view, frame
        image = None if frame is None else frame.image
        self._publisher.packets.put(SetupPacket(view, self._steps, image))

    def wishes(self) -> Iterator[Wish]:
        """See `Desk`."""
        for asked in self._publisher.asked():
            if (wish := wish_of(asked)) is not None:
                yield wish

"""The USB board in the loop: its lamp follows the touches, its foot switch acts."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from rig.live.snapshot import Snapshot

if TYPE_CHECKING:
    from rig.scene.board import BoardSection
    from rig.usb.link import BoardLink


class BoardSink:
    """Call it with each snapshot, once it has its board.

    Parameters
    ----------
    section : BoardSection
    full : float, N
        Load at which a lamp that follows the force is as bright as it gets.
    act : callable
        Takes the snapshot in which the foot switch was pressed.
    """

    def __init__(self, section: BoardSection, full: float, act: Callable[[Snapshot], object]):
        self._section, self._full, self._act = section, full, act
        self._link: BoardLink | None = None

    @property
    def trouble(self) -> str:
        """Why the board does not work any more, as a sentence; empty while it does."""
        return self._link.trouble if self._link else ""

    def use(self, link: BoardLink) -> None:
        """Take the board that works from now on."""
        self._link = link

    def __call__(self, snapshot: Snapshot) -> None:
        """Light the lamp as the touches are, and act once for each press."""
        if self._link is None:
            return
        if self._section.lamp_follows:
            self._link.light(lamp_level(self._section, snapshot, self._full))
        for _ in range(self._link.pressed()):
            self._act(snapshot)


def lamp_level(section: BoardSection, snapshot: Snapshot, full: float) -> float:
    """Light of a lamp that follows the touches, 0 to 1."""
    brightest = section.lamp or 0.0
    if section.lamp_follows == "touch":
        return brightest if snapshot.touches else 0.0
    load = sum(max(mark.force, 0.0) for mark in snapshot.touches)
    return brightest * min(load / full, 1.0)

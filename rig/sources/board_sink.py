"""The USB board in the loop: its lamp follows the touches, its foot switch acts."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from rig.live.snapshot import Snapshot
from rig.scene import Scene

if TYPE_CHECKING:
    from rig.recording.control import Switch
    from rig.scene.board import BoardSection
    from rig.usb.link import BoardLink

Act = Callable[[Snapshot], object]
"""Takes the snapshot in which the foot switch was pressed."""


class BoardSink:
    """Call it with each snapshot.

    Parameters
    ----------
    section : BoardSection
    link : BoardLink
        The board at work.
    full : float, N
        Load at which a lamp that follows the force is as bright as it gets.
    act : callable
        Takes the snapshot in which the foot switch was pressed.
    """

    def __init__(self, section: BoardSection, link: BoardLink, full: float, act: Act):
        self._section, self._link, self._full, self._act = section, link, full, act

    @property
    def trouble(self) -> str:
        """Why the board does not work any more, as a sentence; empty while it does."""
        return self._link.trouble

    def __call__(self, snapshot: Snapshot) -> None:
        """Light the lamp as the touches are, and act once for each press."""
        if self._section.lamp_follows:
            self._link.light(lamp_level(self._section, snapshot, self._full))
        for _ in range(self._link.pressed()):
            self._act(snapshot)


def open_board_sink(
    scene: Scene,
    link: BoardLink,
    renew: Act,
    switch: Switch | None,
    say: Callable[[str], object],
    open_parts: ExitStack,
) -> BoardSink:
    """Make what has a board's lamp follow the touches, and its foot switch do what a scene says.

    Parameters
    ----------
    scene : Scene
    link : BoardLink
        The board at work.
    renew : callable
        Renews the reference.
    switch : Switch or None
        Of recordings, where the foot switch begins and ends them.
    say : callable
        Takes sentences on what a press has done.
    open_parts : ExitStack

    Raises
    ------
    ValueError
        If the scene has no board.
    """
    section = scene.board
    if section is None:
        raise ValueError("scene has no board for the loop to work with; give it a section [board]")
    act = renew
    if section.foot_switch == "record" and switch:
        act = _toggle(switch, say)
    elif section.foot_switch == "snapshot":
        from rig.recording.stills import Stills

        act = open_parts.enter_context(Stills(Path(), say))
    full = scene.touches.force[1] * scene.touches.max_touches if scene.touches else 1.0
    return BoardSink(section, link, full, act)


def lamp_level(section: BoardSection, snapshot: Snapshot, full: float) -> float:
    """Light of a lamp that follows the touches, 0 to 1."""
    brightest = section.lamp or 0.0
    if section.lamp_follows == "touch":
        return brightest if snapshot.touches else 0.0
    load = sum(max(mark.force, 0.0) for mark in snapshot.touches)
    return brightest * min(load / full, 1.0)


def _toggle(switch: Switch, say: Callable[[str], object]) -> Act:
    def act(_: Snapshot) -> None:
        switch.toggle()
        said = switch.summary()
        say(switch.refusal or (said["status"] if said else "the recording has ended"))

    return act

"""Frames with the projector's light taken out, before anything else looks at them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from rig.projector.content import Content, draw
from rig.projector.display_log import DisplayLog
from rig.projector.light_map import LightMap, divided
from rig.projector.markers import Screen

if TYPE_CHECKING:
    from rig.system.frame import Frame, Source


class LightCorrected:
    """A `rig.system.frame.Source` that divides each frame by the light that was on it.

    Parameters
    ----------
    source : Source
    shown : DisplayLog
    screen : Screen
        The projector's image.
    light : LightMap
    delay : float, s
        From the command to the light.
    """

    def __init__(
        self, source: Source, shown: DisplayLog, screen: Screen, light: LightMap, delay: float
    ):
        self._source, self._shown, self._screen = source, shown, screen
        self._light, self._delay = light, delay
        self._drawn: Content = ()
        self._lit = light.on_camera(draw((), screen))

    @property
    def status(self) -> str:
        """See `Source.status`."""
        return self._source.status

    def grab(self, timeout: float) -> Frame | None:
        """See `Source.grab`."""
        frame = self._source.grab(timeout)
        if frame is None:
            return None
        content = self._shown.at(frame.captured - self._delay)
        if content == ():
            return frame
        if content != self._drawn:  # much of a demo stays as it is for many frames
            self._drawn, self._lit = content, self._light.on_camera(draw(content, self._screen))
        light = self._lit
        return replace(frame, image=divided(frame.image, light, self._light.black))

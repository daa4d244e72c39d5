"""Guide for noise and gain of the camera: a still image at several brightnesses."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rig.calibration.guide import Progress
from rig.calibration.photon import Photon, photon_transfer
from rig.projector.content import Content
from rig.system.arrays import AnyArray
from rig.system.frame import Frame

FRAMES = 12  # of a series
STEADY = 0.02  # by which the brightness may vary in one
OTHER = 0.2  # by which it must differ from all other series


@dataclass
class NoiseGuide:
    """Takes a series whenever the image stands still at a new brightness.

    Parameters
    ----------
    black : float, grey levels
        Level of an image without light.
    wanted : int
        Number of brightnesses.
    """

    black: float = 0.0
    wanted: int = 3
    _series: dict[int, list[AnyArray]] = field(default_factory=dict[int, list[AnyArray]])
    _now: list[AnyArray] = field(default_factory=list[AnyArray])
    _says: str = "leave plate and camera alone"

    @property
    def progress(self) -> Progress:
        """See `Guide`."""
        views = tuple(
            (name, f"{np.mean(frames[0]):.0f} grey levels") for name, frames in self._series.items()
        )
        return Progress(self._says, len(self._series), self.wanted, None, views)

    @property
    def shows(self) -> Content:
        """See `Guide`."""
        return ()

    def add_frame(self, frame: Frame) -> None:
        """See `Guide`."""
        level = float(frame.image.mean())
        known = [float(np.mean(frames[0])) for frames in self._series.values()]
        if any(abs(level - one) < OTHER * one for one in known):
            self._says, self._now = "change the light or the exposure by a third, then wait", []
            return
        if self._now and abs(level - self._now[0].mean()) > STEADY * level:
            self._now = []
        self._says = "leave plate and camera alone"
        self._now.append(frame.image)
        if len(self._now) == FRAMES:
            self._series[max(self._series, default=-1) + 1] = self._now
            self._now = []

    def drop(self, view: int) -> None:
        """See `Guide`."""
        self._series.pop(view, None)

    def result(self) -> Photon | None:
        """See `Guide`."""
        if len(self._series) < self.wanted:
            return None
        return photon_transfer(list(self._series.values()), self.black)

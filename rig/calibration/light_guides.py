"""Guides that use the projector: stripes tell where its light falls, flashes how late it comes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from time import monotonic

import numpy as np
from numpy.random import Generator

import synthetic
from rig.calibration.entries import LatencyEntry
from rig.calibration.guide import Progress
from rig.calibration.latency import Latency, measure_latency
from rig.calibration.projector import ProjectorLight
from rig.calibration.steps import light_of
from rig.projector import gray_code
from rig.projector.content import Content, Plain, Stripe
from rig.scene.plate import PlateSection
from rig.system.arrays import AnyArray
from rig.system.frame import Frame

SETTLING = 0.5  # s from a new image to the first frame that counts, where the delay is not known
LATEST = 2.0  # times a delay that 95 % of flashes do not exceed: no frame shows the old image then
MEAN = 2  # frames of each image
FLASHES = 15
LIT, DARK = 0.15, 0.6  # s of a flash, and from one to the next at least
SPREAD = 0.1  # s by which the next flash comes later, at random: frames must not keep step with it


def settling_of(latency: LatencyEntry | None) -> float:
    """Time after which a frame shows a new image of the projector alone, s."""
    return SETTLING if latency is None else min(SETTLING, LATEST * latency.p95)


@dataclass
class StripesGuide:
    """Projects the Gray code, image by image.

    Parameters
    ----------
    camera : synthetic.Camera
        Calibrated, at the pose of the plate.
    plate : PlateSection
    size : (width, height) of the projector, px
    settling : float, s
        From a new image to the first frame that counts; see `settling_of`.
    """

    camera: synthetic.Camera
    plate: PlateSection
    size: tuple[int, int]
    settling: float = SETTLING
    _images: list[AnyArray] = field(default_factory=list[AnyArray])
    _series: list[AnyArray] = field(default_factory=list[AnyArray])
    _since: float | None = None

    @property
    def progress(self) -> Progress:
        """See `Guide`."""
        wanted = gray_code.count(self.size)
        return Progress(
            "leave the plate alone and keep the light steady", len(self._images), wanted
        )

    @property
    def shows(self) -> Content:
        """See `Guide`."""
        return Stripe(min(len(self._images), gray_code.count(self.size) - 1))

    def add_frame(self, frame: Frame) -> None:
        """See `Guide`."""
        if len(self._images) == gray_code.count(self.size):
            return
        if self._since is None:
            self._since = frame.captured
        if frame.captured - self._since < self.settling:
            return
        self._series.append(frame.image)
        if len(self._series) == MEAN:
            self._images.append(np.asarray(np.mean(self._series, axis=0), dtype=np.float32))
            self._series, self._since = [], None

    def drop(self, view: int) -> None:
        """See `Guide`; all images are taken anew."""
        self._images, self._series, self._since = [], [], None

    def result(self) -> ProjectorLight | None:
        """See `Guide`."""
        if len(self._images) < gray_code.count(self.size):
            return None
        return light_of(self._images, self.camera, self.plate, self.size)


@dataclass
class LatencyGuide:
    """Flashes the projector, and looks when the image gets brighter.

    Parameters
    ----------
    rng : Generator
        Of the pauses.
    clock : callable
        Monotonic time, s; the same that stamps the frames.
    wanted : int
        Number of flashes.
    """

    rng: Generator
    clock: Callable[[], float] = monotonic
    wanted: int = FLASHES
    _asked: list[float] = field(default_factory=list[float])
    _captured: list[float] = field(default_factory=list[float])
    _brightness: list[float] = field(default_factory=list[float])
    _next: float | None = None

    @property
    def progress(self) -> Progress:
        """See `Guide`."""
        return Progress(
            "leave the plate alone and keep the light steady", len(self._asked), self.wanted
        )

    @property
    def shows(self) -> Content:
        """See `Guide`; asking for it again and again makes the flashes come in time."""
        now = self.clock()
        if self._next is None:
            self._next = now + DARK
        if now >= self._next and len(self._asked) < self.wanted:
            self._asked.append(now)
            self._next = now + DARK + self.rng.uniform(0, SPREAD)
        lit = bool(self._asked) and now < self._asked[-1] + LIT
        return Plain(255 if lit else 0)

    def add_frame(self, frame: Frame) -> None:
        """See `Guide`."""
        self._captured.append(frame.captured)
        self._brightness.append(float(frame.image[::4, ::4].mean()))

    def drop(self, view: int) -> None:
        """See `Guide`; all flashes are given anew."""
        self._asked, self._captured, self._brightness = [], [], []
        self._next = None

    def result(self) -> Latency | None:
        """See `Guide`."""
        if len(self._asked) < self.wanted or self.clock() < self._asked[-1] + 2 * DARK:
            return None
        return measure_latency(self._asked, self._captured, self._brightness)

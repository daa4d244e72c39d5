"""Leads a known weight from mark to mark, and keeps what was seen while it lay still."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

import fe
from rig.calibration.collect import HOLD, Collector
from rig.calibration.guide import Progress
from rig.calibration.requested_presses import BORDER
from rig.live.snapshot import Mark
from rig.system.arrays import F32
from rig.system.frame import Frame

PLACES = ((1, 1), (3, 1), (5, 1), (5, 3), (3, 3), (1, 3), (1, 5), (3, 5), (5, 5))
"""Sixths of the inner plate along x and y, in the order in which they are asked for."""
BESIDE = 20.0  # mm from its mark: a model that nothing has corrected errs by less
LIES = 2.0  # s that a weight is looked at, once it lies still,
DARKENS = 0.4  # without the first ones, until the light of its mark is gone
SEEN = 5  # frames in a row that show a press beside its mark, before that is said


def targets(size: tuple[float, float], weight: float) -> tuple[fe.Touch, ...]:
    """Return where the weight, N, is to be laid on a plate of `size` mm."""
    inner = [(1 - 2 * BORDER) * side for side in size]
    return tuple(
        fe.Touch(BORDER * size[0] + x / 6 * inner[0], BORDER * size[1] + y / 6 * inner[1], weight)
        for x, y in PLACES
    )


@dataclass
class WeightGuide:
    """Follows the touches of every frame, and takes each press where it was asked for.

    Parameters
    ----------
    targets : tuple of fe.Touch

    Attributes
    ----------
    taken : list of (fe.Touch, frames, (H, W) float32)
        Each press, the number of frames in which it stood still, and their mean.
    """

    targets: tuple[fe.Touch, ...]
    taken: list[tuple[fe.Touch, int, F32]] = field(default_factory=list[tuple[fe.Touch, int, F32]])
    _frames: deque[Frame] = field(default_factory=deque[Frame])
    _collector: Collector | None = None
    _lies_since: float | None = None
    _released: bool = True
    _astray: int = 0
    _says: str = ""

    @property
    def target(self) -> fe.Touch | None:
        """Where the weight is to be laid now; None when all presses were taken."""
        return self.targets[len(self.taken)] if len(self.taken) < len(self.targets) else None

    @property
    def mark(self) -> fe.Touch | None:
        """What is to be lit now: nothing while a weight is looked at."""
        return None if self._lies_since is not None else self.target

    @property
    def progress(self) -> Progress:
        """Where it stands."""
        return Progress(self._sentence(), len(self.taken), len(self.targets))

    def _sentence(self) -> str:
        if self.target is None:
            return "all presses are taken"
        if self._says:
            return self._says
        if not self._released:
            return "take the weight off the plate"
        if self._lies_since is not None:
            return "leave it there"
        at = f"{self.target.x:.0f}, {self.target.y:.0f} mm"
        return f"lay the weight on the mark at {at}, and let go of it"

    def add_frame(self, frame: Frame, found: tuple[Mark, ...]) -> None:
        """Follow a frame and the touches that were found in it."""
        target = self.target
        self._released |= not found
        if target is None or not self._released:
            return
        self._frames.append(frame)
        if self._lies_since is not None:
            self._follow_still(found, target, frame.captured - self._lies_since)
            return
        while frame.captured - self._frames[0].captured > HOLD / 2:
            self._frames.popleft()
        if self._is_beside(found, target):
            return
        self._collector = self._collector or Collector((target,), 1)
        if self._collector.add_frame(found, frame.captured):
            self._lies_since, self._collector = frame.captured, None

    def _follow_still(self, found: tuple[Mark, ...], target: fe.Touch, age: float) -> None:
        """Look at a weight that lies still; one that is lifted too early is laid again."""
        if len(found) == 1 and age < LIES:
            if age < DARKENS:
                self._frames.clear()
            return
        if len(found) == 1:
            images = [one.image for one in self._frames]
            mean = np.asarray(np.mean(images, axis=0), dtype=np.float32)
            self.taken.append((target, len(images), mean))
            self._released = False
        else:
            self._says = "the weight must lie longer; lay it on the mark again"
        self._lies_since = None
        self._frames.clear()

    def _is_beside(self, found: tuple[Mark, ...], target: fe.Touch) -> bool:
        """Whether a finger presses elsewhere, and say so once it does not pass by."""
        away = [float(np.hypot(one.x - target.x, one.y - target.y)) for one in found]
        beside = bool(away) and min(away) > BESIDE
        self._astray = self._astray + 1 if beside else 0
        if not found or (away and not beside):
            self._says = ""
        if self._astray >= SEEN:
            self._collector = None
            self._says = (
                f"that press is {min(away):.0f} mm beside the mark; lift it, and lay the weight on"
                f" the mark at {target.x:.0f}, {target.y:.0f} mm"
            )
        return beside

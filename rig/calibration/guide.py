"""What the guided calibrations have in common: fed with frames, they say what to do next.

A guide knows neither camera nor window: who runs it feeds it with frames, shows its sentence, and
projects what it asks for. So the command, the page and the tests run the same one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from rig.calibration.results import Part
from rig.projector.content import Content
from rig.system.frame import Frame


@dataclass(frozen=True)
class Progress:
    """Where a guided calibration stands.

    Attributes
    ----------
    sentence : str
        What to do now.
    taken, wanted : int
        Views, images or flashes so far, and how many are enough.
    error : float or None
        What the part made of those taken would leave: mm, s for the latency, a fraction for the
        noise.
    views : tuple of (int, str)
        Numbers of the views that can be dropped, and what to know of each.
    """

    sentence: str
    taken: int
    wanted: int
    error: float | None = None
    views: tuple[tuple[int, str], ...] = ()


class Guide(Protocol):
    """A calibration in steps."""

    @property
    def progress(self) -> Progress:
        """Where it stands."""
        ...

    @property
    def shows(self) -> Content:
        """What the projector is to show now."""
        ...

    def add_frame(self, frame: Frame) -> None:
        """Take a frame."""
        ...

    def drop(self, view: int) -> None:
        """Take a bad view out by its number."""
        ...

    def result(self) -> Part | None:
        """Return the calibration once enough was taken; None before.

        Raises
        ------
        ValueError
            If what was taken determines nothing.
        """
        ...

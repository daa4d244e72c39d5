"""The projector as the live loop has it: what it shows of a frame, and does to the next ones."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING

from rig.projector.blanking import Blanked, Blink
from rig.projector.latency_prediction import predicted
from rig.projector.light_correction import LightCorrected
from rig.projector.light_map import LightMap
from rig.projector.markers import Screen
from rig.projector.modes import Mode, placed
from rig.projector.window import Projector, open_projector

if TYPE_CHECKING:
    from rig.calibration.store import Calibration
    from rig.live.snapshot import Mark, Snapshot
    from rig.scene.loop import ProjectorSection
    from rig.system.frame import Source

OLDEST = 0.1  # s from the capture of a frame, after which its touches are not shown any more
TYPICAL = 0.02  # s from the command to the light, where it was not measured


class Show:
    """Call it with each snapshot; use `filtered` on the source of the frames.

    Parameters
    ----------
    window : ProjectorSection
    screen : Screen
    mode : Mode
    plate_size : (a, b), mm
    delay : float, s
        From the command to the light.
    clock : callable
        Monotonic time, s; the same that stamps the frames.

    Attributes
    ----------
    mode : Mode
    """

    def __init__(
        self,
        window: Projector,
        screen: Screen,
        mode: Mode,
        plate_size: tuple[float, float],
        delay: float,
        clock: Callable[[], float] = monotonic,
    ):
        self._window, self._screen = window, screen
        self.mode: Mode = mode
        self._plate_size, self._delay, self._clock = plate_size, delay, clock

    @property
    def status(self) -> str:
        """One sentence for the user."""
        return self._window.status

    @property
    def trouble(self) -> str:
        """The status, where nothing is shown; empty where it is."""
        return "" if self._window.alive else self._window.status

    def __call__(self, snapshot: Snapshot) -> None:
        """Show the touches of a frame; of one that is too old nothing, for they have moved on."""
        old = self._clock() - snapshot.captured > OLDEST
        self._window(() if old else self.marks(snapshot))

    def marks(self, snapshot: Snapshot) -> tuple[Mark, ...]:
        """Return the marks of a frame, where the mode puts them when their light arrives."""
        ahead = self._clock() - snapshot.captured + self._delay
        touches = predicted(snapshot.touches, ahead, self._plate_size)
        return placed(touches, self.mode, self._plate_size)

    def filtered(self, source: Source, light: LightMap | None, interval: float) -> Source:
        """Keep the projector's light out of a source.

        Parameters
        ----------
        source : Source
        light : LightMap or None
            To divide each frame by; None where it was not measured.
        interval : float, s
            From frame to frame.
        """
        if self.mode == "dark":
            return Blanked(source, Blink(), self._delay, interval)
        if light is None or light.strength == 0:
            return source
        return LightCorrected(source, self._window.shown, self._screen, light, self._delay)


@contextmanager
def open_show(
    section: ProjectorSection,
    screen: Screen,
    plate_size: tuple[float, float],
    calibration: Calibration,
) -> Generator[Show]:
    """Open the window of a scene's projector.

    Raises
    ------
    ValueError
        If frames are to be taken in the dark and nobody knows when that is.
    """
    latency = calibration.latency
    if section.mode == "dark" and latency is None:
        raise ValueError(
            'projector.mode "dark" must know how late light comes; run `touchplate calibrate'
            ' latency` first, or set projector.mode to "beside"'
        )
    blink = Blink() if section.mode == "dark" else None
    delay = latency.median if latency else TYPICAL
    place = section.display, section.full_screen, blink, section.output
    with open_projector(screen, *place) as window:
        yield Show(window, screen, section.mode, plate_size, delay)

"""The projector as the live loop has it: what it shows of a frame, and does to the next ones."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from time import monotonic, sleep
from typing import TYPE_CHECKING

from rig.projector.blanking import Blanked, Blink
from rig.projector.demos.demo import Demo, begin_demo
from rig.projector.demos.moment import Moment, load_of
from rig.projector.demos.weighing import Weighing
from rig.projector.latency_prediction import predicted
from rig.projector.light_correction import LightCorrected
from rig.projector.light_map import LightMap
from rig.projector.markers import Screen
from rig.projector.modes import Mode, placed
from rig.projector.window import Projector, open_projector

if TYPE_CHECKING:
    from rig.calibration.store import Calibration
    from rig.live.snapshot import Mark, Snapshot
    from rig.projector.content import Content
    from rig.scene.loop import ProjectorSection
    from rig.system.frame import Source

OLDEST = 0.1  # s from the capture of a frame, after which its touches are not shown any more
TYPICAL = 0.02  # s from the command to the light, where it was not measured
PATIENCE = 5.0  # s for a window to open, before the reference is taken in the light of a demo
SETTLED, PAUSE = 0.3, 0.03  # s in which that light comes on, and between two commands


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
    demo : Demo or None
        What is shown in the place of marks.

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
        demo: Demo | None = None,
    ):
        self._window, self._screen = window, screen
        self._demo = demo
        self._latest: Snapshot | None = None
        self._written: Content | None = None
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
        self._window(self.content(snapshot))

    def write(self, content: Content) -> None:
        """Show this from now on in the place of what would be shown of frames.

        A window that is busy has it with one of the next frames.
        """
        self._written = content
        self._window(content)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the projector's image, px."""
        return self._screen.size

    def content(self, snapshot: Snapshot) -> Content:
        """Return what is shown of a frame; a demo goes on by one that it has not had."""
        if self._written is not None:
            return self._written
        old = self._clock() - snapshot.given > OLDEST
        marks = () if old else self.marks(snapshot)
        if self._demo is None:
            return marks
        if snapshot is not self._latest:
            self._latest = snapshot
            moment = Moment(snapshot.captured, marks, load_of(snapshot))
            self._demo = self._demo.after(moment)
        return self._demo

    def rest(self) -> None:
        """Light the plate as it is untouched, so that the reference is taken in that light.

        A window that does not open within `PATIENCE` s is waited for no longer.
        """
        if self._demo is None or self.mode == "dark":
            return
        with suppress(OSError):
            self._window.wait(PATIENCE)
        end = monotonic() + SETTLED + self._delay
        while self._window.alive and monotonic() < end:
            self._window(self._demo)
            sleep(PAUSE)

    def tare(self, snapshot: Snapshot) -> bool:
        """Set a demo back; whether that was all that was wanted.

        A scale takes the load that rests on it for nothing: the reference cannot be renewed then.
        """
        if self._demo is None:
            return False
        self._demo = self._demo.tared()
        return isinstance(self._demo, Weighing) and bool(snapshot.touches)

    def marks(self, snapshot: Snapshot) -> tuple[Mark, ...]:
        """Return the marks of a frame, where the mode puts them when their light arrives."""
        ahead = self._clock() - snapshot.given + self._delay
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
    full: float = 1.0,
) -> Generator[Show]:
    """Open the window of a scene's projector.

    `full` is the largest load that is expected, N.

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
        demo = None
        if section.content != "marks":
            demo = begin_demo(section.content, plate_size, full)
        yield Show(window, screen, section.mode, plate_size, delay, demo=demo)

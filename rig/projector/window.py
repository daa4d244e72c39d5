"""The projector's window, in a process of its own that follows the loop and never holds it."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from multiprocessing.process import BaseProcess

from rig.projector.blanking import Blink
from rig.projector.content import Content, Image
from rig.projector.display_log import DisplayLog
from rig.projector.image_link import ImageLink, image_links
from rig.projector.markers import Screen
from rig.projector.window_process import CLOSED, SECONDS_BETWEEN_EVENTS, Wanted, Word, run_window
from rig.system.process import deaf_to_interrupts, without_script

SECONDS_TO_CLOSE = 2.0
SECONDS_TO_ANSWER = 3.0  # after which a window that has answered before is taken for stuck
SECONDS_TO_RETRY = 2.0  # after a window has gone, before another is opened
Start = Callable[[Wanted], tuple[ImageLink, BaseProcess]]


class Projector:
    """Call it with the marks of a frame: the window shows the newest that it has time for.

    At most one message is under way at a time: the window answers each, and only then gets the
    next; an image that it has is not sent again. So a slow or stuck window costs the loop nothing.
    A window that has gone, with its display for instance, is opened again until it comes back,
    unless the user has closed it.

    Parameters
    ----------
    start : callable
        Takes which output it is to be on, see `choose_output`, and starts a process with a window;
        gives the link to it, and the process.
    name : str
        Of the display, for the sentences.
    output : str, int or None
        Which output the first window is on; the next ones are on the same.

    Attributes
    ----------
    status : str
        One sentence for the user: what the window shows, or why there is none.
    alive : bool
        Whether there is a window, or one is opening.
    pid : int or None
        Number of the window's process.
    shown : DisplayLog
        What the window was given, and when.
    """

    def __init__(self, start: Start, name: str, output: Wanted = None):
        self.status = f"projector window on {name} is opening"
        self.shown = DisplayLog()
        self._start, self._name = start, name
        self._output: Wanted = output
        self._open()

    def __call__(self, content: Content) -> None:
        """Show this, unless the window is still busy with what it was given before."""
        now = time.monotonic()
        if not self.alive:
            if self.status != CLOSED and now - self._since > SECONDS_TO_RETRY:
                self.close()
                self._open()
            return
        try:
            while self._link.poll():
                word: Word = self._link.recv()
                self._ready, self.status, self._output = word
                self._sound = self._ready
            if self._ready:
                self._send(content, now)
            elif self._sound and now - self._since > SECONDS_TO_ANSWER:
                self._lose("does not answer", now)
        except (EOFError, OSError):
            self._lose("has gone", now)

    def wait(self, patience: float) -> None:
        """Wait until the window is there.

        Raises
        ------
        OSError
            If it does not open in `patience` s; the text says why.
        """
        end = time.monotonic() + patience
        while not self._sound:
            self(())
            if time.monotonic() > end or not self.alive:
                raise OSError(self.status)
            time.sleep(SECONDS_BETWEEN_EVENTS)

    def close(self) -> None:
        """Close the window; one that does not answer is killed."""
        self._link.close()
        self._window.join(SECONDS_TO_CLOSE if self.alive else 0.0)
        if self._window.is_alive():
            self._window.kill()
            self._window.join()
        self._window.close()

    def _open(self) -> None:
        self._link, self._window = self._start(self._output)
        self.pid = self._window.pid
        self._ready = self._sound = False
        self._sent: Content = ()
        self.alive, self._since = True, time.monotonic()

    def _send(self, content: Content, now: float) -> None:
        """Send what is to be shown, unless it is the image that the window has."""
        if isinstance(content, Image) and content is self._sent:
            return
        self._link.send(content)
        self.shown.add(now, content)
        self._ready, self._since, self._sent = False, now, content

    def _lose(self, how: str, now: float) -> None:
        """Note that there is no window; where it has said why, that stands."""
        self.alive, self._since = False, now
        if self._sound:
            self.status = f"projector window on {self._name} {how}; it is opened again"


@contextmanager
def open_projector(
    screen: Screen,
    display: str | None = None,
    full_screen: bool = True,
    blink: Blink | None = None,
    output: str | int | None = None,
) -> Generator[Projector]:
    """Open a window on a display and give the `Projector` that feeds it.

    A display that is absent is no error: the status says so and the loop goes on.

    Parameters
    ----------
    screen : Screen
        Size of the image and the place of the plate in it.
    display : str or None
        Name of the X display such as ``":0"``; None leaves the choice to the system.
    full_screen : bool
        Whether the window covers its output, whose resolution must then be the screen's.
    blink : Blink or None
        When marks are lit; None shows them all the time.
    output : str, int or None
        Which output of the desktop it is on, see `choose_output`.
    """
    context = multiprocessing.get_context("spawn")

    def start(wanted: Wanted) -> tuple[ImageLink, BaseProcess]:
        ours, theirs = image_links(context, screen.size)
        given = theirs, screen, display, full_screen, blink, wanted
        window = context.Process(target=run_window, args=given, daemon=True)
        with deaf_to_interrupts(), without_script():
            window.start()
        theirs.close()
        return ours, window

    projector = Projector(start, display or "the display", output)
    try:
        yield projector
    finally:
        projector.close()

"""The projector's window, in a process of its own that follows the loop and never holds it."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import TYPE_CHECKING

from rig.projector.blanking import Blink
from rig.projector.content import Content, draw
from rig.projector.display_log import DisplayLog
from rig.projector.markers import Screen
from rig.projector.outputs import (
    Output,
    allow_acceleration,
    choose_output,
    full_window,
    list_outputs,
    open_window,
    use_display,
)
from rig.system.process import deaf_to_interrupts, leave_signals_to_the_loop

if TYPE_CHECKING:
    import pygame

SECONDS_TO_CLOSE = 2.0
SECONDS_TO_ANSWER = 3.0  # after which a window that has answered before is taken for stuck
SECONDS_TO_RETRY = 2.0  # after a window has gone, before another is opened
SECONDS_BETWEEN_EVENTS = 0.05
GONE = "output {!r} is not there any more or has changed; plug it in again"
CLOSED = "projector window was closed; restart the loop to open it again"
Start = Callable[[], tuple[Connection, BaseProcess]]


class Projector:
    """Call it with the marks of a frame: the window shows the newest that it has time for.

    At most one message is under way at a time: the window answers each, and only then gets the
    next. So a slow or stuck window costs the loop nothing. A window that has gone, with its display
    for instance, is opened again until it comes back, unless the user has closed it.

    Parameters
    ----------
    start : callable
        Starts a process with a window; gives the link to it, and the process.
    name : str
        Of the display, for the sentences.

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

    def __init__(self, start: Start, name: str):
        self.status = f"projector window on {name} is opening"
        self.shown = DisplayLog()
        self._start, self._name = start, name
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
                self._ready, self.status = self._link.recv()
                self._sound = self._ready
            if self._ready:
                self._link.send(content)
                self.shown.add(now, content)
                self._ready, self._since = False, now
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
        self._link, self._window = self._start()
        self.pid = self._window.pid
        self._ready = self._sound = False
        self.alive, self._since = True, time.monotonic()

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

    def start() -> tuple[Connection, BaseProcess]:
        ours, theirs = context.Pipe()
        given = theirs, screen, display, full_screen, blink, output
        window = context.Process(target=_run_window, args=given, daemon=True)
        with deaf_to_interrupts():
            window.start()
        theirs.close()
        return ours, window

    projector = Projector(start, display or "the display")
    try:
        yield projector
    finally:
        projector.close()


def _run_window(
    link: Connection,
    screen: Screen,
    display: str | None,
    full_screen: bool,
    blink: Blink | None,
    wanted: str | int | None,
) -> None:
    """Body of the window's process: ends when the loop closes the link or dies."""
    leave_signals_to_the_loop()
    use_display(display)
    import pygame

    try:
        window, output = _open_window(screen.size, full_screen, wanted)
    except pygame.error as error:
        name = display or "the display"
        _report(link, False, f"no projector window: {name} did not open ({error})")
        return
    except ValueError as error:
        _report(link, False, f"no projector window: {error}")
        return
    width, height = screen.size
    place = " ".join(filter(None, (display, output.name)))
    status = f"projector window on {place or 'the display'}, {width} x {height} px"
    _follow(link, _Canvas(window, screen), status, blink, output)
    pygame.quit()


def _open_window(
    size: tuple[int, int], full_screen: bool, wanted: str | int | None
) -> tuple[pygame.Window, Output]:
    """Open the window and give it, and the output that it is on.

    A full screen of another resolution would scale the image, so it is refused.
    """
    import pygame

    pygame.display.init()
    allow_acceleration()
    outputs = list_outputs()
    if full_screen or wanted is not None:
        output = choose_output(outputs, wanted, size)
    else:
        output = outputs[0]
    if full_screen and output.size != size:
        raise ValueError(
            f"projector size is {size[0]} x {size[1]} px but output {output}; set projector.size"
            " to the output's, or projector.output to another"
        )
    window = full_window(output, size) if full_screen else open_window(output, size)
    pygame.mouse.set_visible(not full_screen)
    return window, output


class _Canvas:
    """Shows images; draws only where that changes what is seen."""

    def __init__(self, window: pygame.Window, screen: Screen):
        self._window, self._screen = window, screen
        self._shown: Content | None = None

    def show(self, content: Content) -> None:
        import pygame

        if content == self._shown:
            return
        drawn = draw(content, self._screen)
        image = pygame.image.frombuffer(drawn.tobytes(), self._screen.size, "RGB")
        self._window.get_surface().blit(image, (0, 0))
        self._window.flip()
        self._shown = content


def _follow(
    link: Connection, canvas: _Canvas, status: str, blink: Blink | None, output: Output
) -> None:
    """Show what comes until the link ends, the user closes the window, or its output goes."""
    import pygame

    content: Content = ()
    canvas.show(content)
    alive = _report(link, True, status)
    while alive:
        if any(_closes(event) for event in pygame.event.get()):
            _report(link, False, CLOSED)
            return
        if output not in list_outputs():
            _report(link, False, f"projector window is gone: {GONE.format(output.name)}")
            return
        patience = SECONDS_BETWEEN_EVENTS
        if blink:
            patience = min(patience, blink.until_change(time.monotonic()))
        try:
            came = link.poll(patience)
            content = link.recv() if came else content
        except (EOFError, OSError):  # the loop has ended
            return
        canvas.show(content if blink is None or blink.on(time.monotonic()) else ())
        alive = not came or _report(link, True, status)


def _closes(event: pygame.event.Event) -> bool:
    import pygame

    escape = event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE
    return escape or event.type == pygame.QUIT


def _report(link: Connection, ready: bool, status: str) -> bool:
    """Send readiness and status to the loop; False when nobody listens any more."""
    try:
        link.send((ready, status))
    except OSError:
        return False
    return True

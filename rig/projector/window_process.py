"""Body of the process that holds the projector's window: it shows what the loop sends."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.projector.blanking import Blink
from rig.projector.content import Content, draw
from rig.projector.image_link import ImageLink
from rig.projector.markers import Screen
from rig.projector.outputs import (
    Output,
    StillThere,
    allow_acceleration,
    choose_again,
    choose_output,
    full_window,
    list_outputs,
    open_window,
    start_display,
    use_display,
)
from rig.system.process import leave_signals_to_the_loop

if TYPE_CHECKING:
    import pygame

SECONDS_BETWEEN_EVENTS = 0.05
GONE = "output {!r} is not there any more or has changed; plug it in again"
CLOSED = "projector window was closed; restart the loop to open it again"
Wanted = str | int | None
"""Which output of the desktop, see `choose_output`."""

Word = tuple[bool, str, Wanted]
"""Whether the window is ready for more, what it shows, and by what its output is to be chosen when
another is opened."""


def run_window(
    link: ImageLink,
    screen: Screen,
    display: str | None,
    full_screen: bool,
    blink: Blink | None,
    wanted: Wanted,
) -> None:
    """Show a window; ends when the loop closes the link or dies.

    Parameters
    ----------
    link : ImageLink
        Gives content, takes a `Word` for each.
    screen : Screen
    display : str or None
    full_screen : bool
    blink : Blink or None
    wanted : str, int or None
        See `rig.projector.window.open_projector`.
    """
    leave_signals_to_the_loop()
    use_display(display)
    import pygame

    loop = _Loop(link, wanted)
    try:
        start_display(display)
        window, output = _open_window(screen.size, full_screen, wanted)
    except pygame.error as error:
        name = display or "the display"
        loop.hears(False, f"no projector window: {name} did not open ({error})")
        return
    except (OSError, ValueError) as error:
        loop.hears(False, f"no projector window: {error}")
        return
    width, height = screen.size
    place = " ".join(filter(None, (display, output.name)))
    status = f"projector window on {place or 'the display'}, {width} x {height} px"
    loop = _Loop(link, choose_again(list_outputs(), output, wanted))
    _follow(loop, _Canvas(window, screen), status, blink, output)
    pygame.quit()


@dataclass(frozen=True)
class _Loop:
    """The link to the loop, and by what the window's output is chosen when it is opened anew."""

    link: ImageLink
    output: Wanted

    def hears(self, ready: bool, status: str) -> bool:
        """Send readiness and status to the loop; False when nobody listens any more."""
        try:
            self.link.send((ready, status, self.output))
        except OSError:
            return False
        return True


def _open_window(
    size: tuple[int, int], full_screen: bool, wanted: Wanted
) -> tuple[pygame.Window, Output]:
    """Open the window and give it, and the output that it is on.

    A full screen of another resolution would scale the image, so it is refused.
    """
    import pygame

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

    def forget(self) -> None:
        """Draw anew when next shown: what was seen has been covered meanwhile."""
        self._shown = None


def _follow(loop: _Loop, canvas: _Canvas, status: str, blink: Blink | None, output: Output) -> None:
    """Show what comes until the link ends, the user closes the window, or its output goes."""
    import pygame

    content: Content = ()
    canvas.show(content)
    still_there = StillThere(output)
    alive = loop.hears(True, status)
    while alive:
        events = pygame.event.get()
        if any(map(_closes, events)):
            loop.hears(False, CLOSED)
            return
        if not still_there():
            loop.hears(False, f"projector window is gone: {GONE.format(output.name)}")
            return
        if any(event.type == pygame.WINDOWEXPOSED for event in events):
            canvas.forget()
        patience = SECONDS_BETWEEN_EVENTS
        if blink:
            patience = min(patience, blink.until_change(time.monotonic()))
        try:
            came = loop.link.poll(patience)
            content = loop.link.recv() if came else content
        except (EOFError, OSError):  # the loop has ended
            return
        canvas.show(content if blink is None or blink.on(time.monotonic()) else ())
        alive = not came or loop.hears(True, status)


def _closes(event: pygame.event.Event) -> bool:
    import pygame

    escape = event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE
    return escape or event.type == pygame.QUIT

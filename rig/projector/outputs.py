"""The outputs of a desktop: screens and projectors, by name, place or number.

SDL knows them alike on X11, Wayland, Windows and macOS. Pygame gives their sizes and no more, so
names and places are asked of the SDL that it brings along; where that is not found they are absent.
"""

from __future__ import annotations

import ctypes
import functools
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pygame

TITLE = "touchplate projector"
UNSEEN = "offscreen", "dummy"
"""What SDL draws to where it finds no desktop, unless SDL_VIDEODRIVER says another."""
LIBRARIES = ("pygame*.libs/libSDL2-2*", "pygame/SDL2.dll", "pygame/.dylibs/libSDL2-2*")
"""Where the SDL of pygame lies beside it, on Linux, Windows and macOS."""


@dataclass(frozen=True)
class Output:
    """One screen of the desktop.

    Attributes
    ----------
    index : int
        Its number, from 0; 0 is the main screen.
    name : str
        What the system calls it; empty where it does not say.
    size : (width, height), px
    place : (x, y) or None
        Of its top left corner on the desktop, px; None where the system does not say.
    """

    index: int
    name: str
    size: tuple[int, int]
    place: tuple[int, int] | None

    def __str__(self) -> str:
        """Say which it is, as it can be chosen."""
        name = f" '{self.name}'" if self.name else ""
        place = f" at {self.place[0]}, {self.place[1]}" if self.place else ""
        return f"{self.index}{name} of {self.size[0]} x {self.size[1]} px{place}"


def use_display(display: str | None) -> None:
    """Choose the X display for SDL, before it is started; None leaves that to the session."""
    os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"
    os.environ["SDL_FRAMEBUFFER_ACCELERATION"] = "0"  # 0.7 ms an image instead of 19 ms
    os.environ["SDL_VIDEO_MINIMIZE_ON_FOCUS_LOSS"] = "0"  # who works on the laptop needs the focus
    if display:
        os.environ |= {"DISPLAY": display, "SDL_VIDEODRIVER": "x11"}
    elif sys.platform == "linux" and not {"DISPLAY", "WAYLAND_DISPLAY"} & set(os.environ):
        os.environ["DISPLAY"] = ":0"  # that of the machine, for one who came over the network


def start_display(display: str | None) -> None:
    """Start SDL on the display that `use_display` chose.

    Raises
    ------
    OSError
        If there is no desktop: SDL does not start, or would draw where nobody sees it.
    """
    import pygame

    try:
        pygame.display.init()
    except pygame.error as error:
        raise _not_open(display, str(error)) from error
    driver = pygame.display.get_driver()
    if driver in UNSEEN and os.environ.get("SDL_VIDEODRIVER") != driver:
        pygame.display.quit()
        raise _not_open(display, f"SDL would draw where nobody sees it: driver '{driver}'")


def _not_open(display: str | None, why: str) -> OSError:
    return OSError(
        f"{display or 'the display'} did not open ({why}); log in to a desktop, or set"
        " projector.display to one"
    )


def allow_acceleration() -> None:
    """Let SDL draw through OpenGL where it cannot do without, once its display is started."""
    import pygame

    if pygame.display.get_driver() == "wayland":
        os.environ["SDL_FRAMEBUFFER_ACCELERATION"] = "1"


def full_window(output: Output, size: tuple[int, int]) -> pygame.Window:
    """Open a window that fills an output.

    It gets its surface before it fills the output: on Wayland that makes it anew, and where it was.
    """
    window = open_window(output, size)
    window.get_surface()
    window.set_fullscreen(True)
    return window


def open_window(output: Output, size: tuple[int, int]) -> pygame.Window:
    """Open a window on an output, where the system lets us choose the place."""
    import pygame

    return pygame.Window(TITLE, size, position=output.place or pygame.WINDOWPOS_UNDEFINED)


def list_outputs() -> tuple[Output, ...]:
    """List the outputs of the desktop; pygame's display must have been started."""
    import pygame

    sizes = pygame.display.get_desktop_sizes()
    library = _library()
    return tuple(
        Output(index, _name(library, index), size, _place(library, index))
        for index, size in enumerate(sizes)
    )


class StillThere:
    """Whether an output shows something still; pygame's display must have been started.

    Parameters
    ----------
    output : Output
    """

    def __init__(self, output: Output):
        import pygame

        self._output, self._monitors = output, None
        (x, y), (width, height) = output.place or (0, 0), output.size
        self._part = x, y, width, height
        if output.place and pygame.display.get_driver() == "x11":
            from rig.projector.x_monitors import XMonitors

            with suppress(OSError):  # then what SDL says must do
                self._monitors = XMonitors()
                self._shown_by = self._monitors.lit().get(self._part)

    def __call__(self) -> bool:
        """Ask SDL, and X where another output may show what this one did and SDL still lists."""
        if self._output not in list_outputs():
            return False
        return self._monitors is None or self._monitors.lit().get(self._part) == self._shown_by


def choose_again(
    outputs: Sequence[Output], output: Output, wanted: str | int | None
) -> str | int | None:
    """Say by what a chosen output is to be chosen when its window is opened anew.

    That is its name, where without it another could be taken: one of its size, or of its number.
    """
    confused = isinstance(wanted, int) or sum(one.size == output.size for one in outputs) > 1
    unique = output.name and [one.name for one in outputs].count(output.name) == 1
    return output.name if confused and unique else wanted


def choose_output(
    outputs: Sequence[Output], wanted: str | int | None, size: tuple[int, int]
) -> Output:
    """Choose the output of a projector.

    Parameters
    ----------
    outputs : sequence of Output
        At least one.
    wanted : str, int or None
        Its number; its name or a part of it; "left", "right", "top" or "bottom"; None for the only
        one that has the projector's size, or of several the last one.
    size : (width, height), px
        Of the projector.

    Raises
    ------
    ValueError
        If there is no such output, or more than one has that name.
    """
    if wanted is None:
        fitting = [output for output in outputs if output.size == size]
        if not fitting:
            raise ValueError(
                f"no output has the projector's {size[0]} x {size[1]} px; set projector.size to"
                f" that of its output, or projector.output: there are {_listed(outputs)}"
            )
        return fitting[-1]
    found = _matching(outputs, wanted)
    if len(found) != 1:
        many = f"{len(found)} outputs are" if found else "no output is"
        raise ValueError(
            f"{many} called {wanted!r}; set projector.output to one of {_listed(outputs)}"
        )
    return found[0]


def _matching(outputs: Sequence[Output], wanted: str | int) -> list[Output]:
    if isinstance(wanted, int):
        return [output for output in outputs if output.index == wanted]
    word = wanted.casefold()
    named = [output for output in outputs if output.name.casefold() == word]
    if named:
        return named
    if word in EDGES and all(output.place for output in outputs):
        return [EDGES[word](outputs)]
    return [output for output in outputs if word in output.name.casefold()]


def _corner(output: Output, axis: int) -> float:
    return output.place[axis] + output.size[axis] / 2 if output.place else 0.0


EDGES: dict[str, Callable[[Sequence[Output]], Output]] = {
    "left": lambda outputs: min(outputs, key=lambda one: _corner(one, 0)),
    "right": lambda outputs: max(outputs, key=lambda one: _corner(one, 0)),
    "top": lambda outputs: min(outputs, key=lambda one: _corner(one, 1)),
    "bottom": lambda outputs: max(outputs, key=lambda one: _corner(one, 1)),
}


def _listed(outputs: Sequence[Output]) -> str:
    return "; ".join(map(str, outputs))


class _Rectangle(ctypes.Structure):
    _fields_ = tuple((name, ctypes.c_int) for name in ("x", "y", "width", "height"))


@functools.cache
def _library() -> Any:
    """SDL as pygame has loaded it; None where it is not found."""
    import pygame

    beside = Path(pygame.__file__).parents[1]
    for pattern in LIBRARIES:
        for path in beside.glob(pattern):
            library = ctypes.CDLL(str(path))
            library.SDL_GetDisplayName.restype = ctypes.c_char_p
            return library
    return None


def _name(library: Any, index: int) -> str:
    name: bytes | None = library.SDL_GetDisplayName(index) if library else None
    return name.decode(errors="replace") if name else ""


def _place(library: Any, index: int) -> tuple[int, int] | None:
    bounds = _Rectangle()
    if library is None or library.SDL_GetDisplayBounds(index, ctypes.byref(bounds)):
        return None
    return bounds.x, bounds.y

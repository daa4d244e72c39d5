"""The projector on one of two outputs: its pixels are read from there, and the laptop has none.

Parts: outputs, unplugged. A Wayland desktop of two outputs without hardware (sway), a laptop of
1368×768 and a projector of 1280×800, in every order; grim reads the pixels of each output back.
Unplugged is the projector of an X desktop (Xorg's dummy driver), put out by xrandr and lit again,
with a laptop that stays or moves to where the projector was, also one of the projector's size.
*Elsewhere for* counts from when the desktop has changed to the first look at the laptop without
marks, once the window has said that its output is gone; the looks that count begin there.
"""

from __future__ import annotations

import importlib
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rig.projector import open_projector
from rig.projector.markers import draw_marks
from rig.report.figure import Figure, at_most
from rig.studies.study import line, run
from rig.system.arrays import Mask

ROOT = Path(__file__).parents[3]
TABLE = "The projector on one of two outputs"
UNPLUGGED = "The projector unplugged and back"
AWAY, AFTER = 6.0, 1.0  # s that the laptop is looked at while the projector is away, and after
PATIENCE = 60.0  # s that a window may take to show its marks on a busy machine
ORDERS = {"laptop first, left": (0, 0), "laptop last, right": (1, 1), "laptop first, right": (0, 1)}
"""Which output the laptop is, and on which side it lies."""


def outputs() -> Iterator[Figure]:
    """Show marks in every order and compare both outputs with what was drawn."""
    sys.path.insert(0, str(ROOT))
    desktops: Any = importlib.import_module("tests.rig.projector.test_outputs")
    for name, (laptop, right) in ORDERS.items():
        folder = Path(tempfile.mkdtemp(prefix="touchplate-desktop-"))
        desktop = desktops.Desktop(folder)
        desktop.start()
        os.environ |= {
            "XDG_RUNTIME_DIR": str(folder),
            "WAYLAND_DISPLAY": desktop.socket.name,
            "SDL_VIDEODRIVER": "wayland",
        }
        try:
            yield from _shown(name, desktops, desktop, laptop, right)
        finally:
            desktop.end()
            shutil.rmtree(folder)


def _shown(name: str, desktops: Any, desktop: Any, laptop: int, right: int) -> Iterator[Figure]:
    sizes = [desktops.SIZE, desktops.SIZE]
    sizes[laptop] = desktops.LAPTOP
    places = [0, 0]
    places[laptop if right else 1 - laptop] = sizes[1 - laptop if right else laptop][0]
    desktop.arrange(list(zip(sizes, places, strict=True)))
    names = desktop.names()
    drawn = draw_marks(desktops.MARKS, desktops.SCREEN)
    end, wrong = time.monotonic() + PATIENCE, drawn[..., 0].size
    with open_projector(desktops.SCREEN, None) as show:
        while wrong and time.monotonic() < end:
            show(desktops.MARKS)
            time.sleep(0.1)
            shown = desktop.pixels(names[1 - laptop])
            if shown.shape == drawn.shape:
                differ: Mask = shown != drawn
                wrong = int(differ.any(axis=2).sum())
        other = desktop.pixels(names[laptop])
        lit: Mask = other == drawn.reshape(-1, 3).max(axis=0)
        astray = int(lit.all(axis=2).sum())
    pixels = int(desktops.SIZE[0] * desktops.SIZE[1])
    yield from line(
        TABLE,
        name,
        pixels_other_than_drawn=(wrong, "", at_most(0), pixels),
        pixels_on_the_laptop=(astray, "", at_most(0)),
    )


def unplugged() -> Iterator[Figure]:
    """Put the projector out and light it again, in every order, and look at both outputs."""
    sys.path.insert(0, str(ROOT))
    cases: Any = importlib.import_module("tests.rig.projector.test_unplugged")
    os.environ.pop("WAYLAND_DISPLAY", None)
    astray, looks = 0, 0
    for name, order in cases.ORDERS.items():
        with tempfile.TemporaryDirectory(prefix="touchplate-desktop-") as folder:
            desktop = cases.XDesktop(Path(folder))
            desktop.start()
            try:
                seen = _unplugged(cases, desktop, *order)
            finally:
                desktop.end()
        astray, looks = astray + seen.astray, looks + seen.looks
        yield from line(
            UNPLUGGED,
            name,
            pixels_other_than_drawn_when_it_is_back=(seen.wrong, "", at_most(0)),
            pixels_on_the_laptop=(seen.astray, "", at_most(0), seen.looks),
            elsewhere_for=(1e3 * seen.elsewhere, "ms"),
            back_after=(seen.back, "s"),
        )
    case = "projector's output unplugged and back: pixels on another one"
    yield from line(UNPLUGGED, case, figure=(astray, "", at_most(0), looks))


@dataclass(frozen=True)
class _Seen:
    """What was seen of one projector that went and came back."""

    astray: int  # lit pixels of the laptop in all looks at it, once the window knew
    looks: int
    elsewhere: float  # s
    wrong: int  # pixels of the projector other than drawn, in the end
    back: float  # s from its return to its last wrong pixel


def _unplugged(cases: Any, desktop: Any, index: int, both: Any, one: Any) -> _Seen:
    desktop.arrange(both)
    alike = both[0][0] == both[1][0]
    wanted = f"DUMMY{index}" if alike else None
    with open_projector(cases.SCREEN, desktop.display, output=wanted) as show:

        def wrong() -> int:
            show(cases.MARKS)
            shown = desktop.pixels(index)
            differ: Mask = shown != cases.DRAWN
            return int(differ.any(axis=2).sum())

        def astray() -> int:
            show(cases.MARKS)
            return cases.astray(desktop, 1 - index)

        _until_none(wrong)
        desktop.arrange(one)
        elsewhere = _until_none(lambda: astray() or "is gone" not in show.status)
        seen = _looks(astray, AWAY)
        desktop.arrange(both)
        back = _until_none(wrong)
        seen += _looks(astray, AFTER)
        return _Seen(sum(seen), len(seen), elsewhere, wrong(), back)


def _looks(count: Callable[[], int], seconds: float) -> list[int]:
    """Count over and over for some time."""
    end, found = time.monotonic() + seconds, list[int]()
    while time.monotonic() < end:
        found.append(count())
    return found


def _until_none(count: Callable[[], int]) -> float:
    """Look until there are none, or patience ends; return the time, s."""
    begun = time.monotonic()
    while count() and time.monotonic() - begun < PATIENCE:
        time.sleep(0.01)
    return time.monotonic() - begun


PARTS = {"outputs": outputs, "unplugged": unplugged}

if __name__ == "__main__":
    run(PARTS, __doc__)

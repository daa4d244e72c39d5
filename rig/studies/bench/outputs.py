"""The projector on one of two outputs: its pixels are read from there, and the laptop has none.

Parts: outputs. A Wayland desktop of two outputs without hardware (sway), a laptop of 1368×768 and a
projector of 1280×800, in every order; grim reads the pixels of each output back.
"""

from __future__ import annotations

import importlib
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rig.projector import open_projector
from rig.projector.markers import draw_marks
from rig.report.figure import Figure, at_most
from rig.studies.study import line, run
from rig.system.arrays import Mask

ROOT = Path(__file__).parents[3]
TABLE = "The projector on one of two outputs"
PATIENCE = 20.0  # s
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


PARTS = {"outputs": outputs}

if __name__ == "__main__":
    run(PARTS, __doc__)

"""The projector's output goes and comes back: no other one shows its pixels meanwhile."""

import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from rig.projector import open_projector, window_process as process
from rig.projector.markers import draw_marks
from rig.projector.outputs import Output, choose_again
from tests.rig.emulation.xorg import XDesktop
from tests.rig.projector.test_outputs import LAPTOP, MARKS, SCREEN, SIZE, wait_for

DRAWN = draw_marks(MARKS, SCREEN)
LIT = DRAWN.reshape(-1, 3).max(axis=0)
ORDERS = {
    "laptop left": (1, [(LAPTOP, 0), (SIZE, LAPTOP[0])], [(LAPTOP, 0), None]),
    "laptop right, moves to where the projector was": (
        0,
        [(SIZE, 0), (LAPTOP, SIZE[0])],
        [None, (LAPTOP, 0)],
    ),
    "laptop left, of the projector's size": (1, [(SIZE, 0), (SIZE, SIZE[0])], [(SIZE, 0), None]),
    "laptop right, of its size, moves to where it was": (
        0,
        [(SIZE, 0), (SIZE, SIZE[0])],
        [None, (SIZE, 0)],
    ),
}
"""Number of the projector, where both are, and where they are while it is unplugged."""


@pytest.fixture
def desktop(tmp_path, monkeypatch):
    if not (shutil.which("Xorg") and shutil.which("xrandr") and shutil.which("xwd")):
        pytest.skip("needs Debian's xserver-xorg-video-dummy, x11-xserver-utils and x11-apps")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr("rig.projector.window.SECONDS_TO_RETRY", 0.2)
    running = XDesktop(tmp_path)
    running.start()
    try:
        yield running
    finally:
        running.end()


def astray(desktop, index):
    """Pixels of an output that are lit as marks are."""
    return int((desktop.pixels(index) == LIT).all(axis=2).sum())


SHORT = "laptop left", "laptop right, of its size, moves to where it was"


@pytest.mark.slow
@pytest.mark.display
@pytest.mark.parametrize(
    "order",
    [name if name in SHORT else pytest.param(name, marks=pytest.mark.slow) for name in ORDERS],
)
def test_a_projector_that_is_unplugged_shows_nothing_elsewhere_and_all_when_it_is_back(
    desktop, order
):
    index, both, one = ORDERS[order]
    desktop.arrange(both)
    wanted = "DUMMY" + str(index) if both[0][0] == both[1][0] else None
    with open_projector(SCREEN, desktop.display, output=wanted) as show:
        wait_for(lambda: show(MARKS) or np.array_equal(desktop.pixels(index), DRAWN))
        desktop.arrange(one)
        wait_for(lambda: show(MARKS) or "is gone" in show.status)
        wait_for(lambda: show(MARKS) or astray(desktop, 1 - index) == 0)
        for _ in range(10):
            wait_for(lambda: show(MARKS) or "no projector window" in show.status)
            assert astray(desktop, 1 - index) == 0
        desktop.arrange(both)
        wait_for(lambda: show(MARKS) or np.array_equal(desktop.pixels(index), DRAWN))
        assert astray(desktop, 1 - index) == 0


def test_an_output_that_another_could_be_taken_for_is_chosen_again_by_its_name():
    laptop = Output(0, "eDP-1", LAPTOP, (0, 0))
    projector, twin = (Output(k, f"HDMI-{k}", SIZE, (1368 * k, 0)) for k in (1, 2))
    assert choose_again((laptop, projector), projector, None) is None
    assert choose_again((laptop, projector), projector, "left") == "left"
    assert choose_again((laptop, projector), projector, 1) == "HDMI-1"
    assert choose_again((projector, twin), twin, None) == "HDMI-2"
    nameless = Output(1, "", SIZE, (1368, 0))
    assert choose_again((laptop, nameless), nameless, 1) == 1
    alike = Output(2, "HDMI-1", SIZE, (2648, 0))
    assert choose_again((projector, alike), alike, "right") == "right"


def test_what_was_covered_is_drawn_anew(monkeypatch):
    import pygame

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pygame.display.init()
    window = SimpleNamespace(flips=0, get_surface=lambda: pygame.Surface(SIZE))

    def flip():
        window.flips += 1

    window.flip = flip
    canvas = process._Canvas(window, SCREEN)
    try:
        canvas.show(MARKS)
        canvas.show(MARKS)
        assert window.flips == 1
        canvas.forget()
        canvas.show(MARKS)
        assert window.flips == 2
    finally:
        pygame.display.quit()

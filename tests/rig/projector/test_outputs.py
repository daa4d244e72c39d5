"""A desktop with two outputs: the window lies on the one that was chosen, whatever their order."""

import io
import json
import multiprocessing
import os
import shutil
import subprocess
import tempfile
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from rig.live.snapshot import Mark
from rig.projector import open_projector, outputs, window_process as process
from rig.projector.markers import draw_marks, fit_plate
from rig.projector.outputs import Output, choose_output
from tests.waiting import wait_for

LAPTOP, SIZE, PLATE = (1368, 768), (1280, 800), (254.0, 180.0)
SCREEN = fit_plate(SIZE, PLATE)
MARKS = (Mark(60.0, 50.0, 2.0), Mark(200.0, 120.0, 0.7))
NOBODY = 65534


def laptop_first():
    return Output(0, "eDP-1", LAPTOP, (0, 0)), Output(1, "HDMI-1", SIZE, (1368, 0))


def laptop_last():
    return Output(0, "HDMI-1", SIZE, (0, 0)), Output(1, "eDP-1", LAPTOP, (1280, 0))


@pytest.mark.parametrize("outputs", [laptop_first(), laptop_last()])
def test_the_projector_is_the_output_of_its_size_by_any_of_its_names(outputs):
    projector = next(output for output in outputs if output.size == SIZE)
    side = "right" if projector.place != (0, 0) else "left"
    for wanted in (None, projector.index, "HDMI-1", "hdmi", side):
        assert choose_output(outputs, wanted, SIZE) is projector
    other = next(output for output in outputs if output.size == LAPTOP)
    assert choose_output(outputs, other.index, SIZE) is other


def test_of_two_alike_the_last_is_taken_and_a_name_decides():
    twins = tuple(Output(i, f"DP-{i}", SIZE, (0, 800 * i)) for i in range(2))
    assert choose_output(twins, None, SIZE) is twins[1]
    assert choose_output(twins, "top", SIZE) is twins[0]
    assert choose_output(twins, "bottom", SIZE) is twins[1]
    with pytest.raises(ValueError, match=r"2 outputs are called .DP.; set"):
        choose_output(twins, "DP", SIZE)


@pytest.mark.parametrize("wanted", [7, "VGA", "left of the desk", ""])
def test_an_output_that_is_not_there_is_refused_with_those_that_are(wanted):
    with pytest.raises(
        ValueError, match=r"is called .*; set projector\.output to one of 0 'eDP-1'"
    ):
        choose_output(laptop_first()[:1] if wanted == "" else laptop_first(), wanted or "x", SIZE)


def test_no_output_of_the_size_is_said_with_those_that_are_there():
    with pytest.raises(ValueError, match="no output has the projector's 800 x 600 px; set"):
        choose_output(laptop_first(), None, (800, 600))


class Desktop:
    """A Wayland desktop of two outputs without hardware: sway, whose pixels grim reads."""

    def __init__(self, folder):
        self.folder = folder
        self._environment = {
            **os.environ, "XDG_RUNTIME_DIR": str(folder), "WLR_BACKENDS": "headless",
            "WLR_HEADLESS_OUTPUTS": "2", "WLR_RENDERER": "pixman", "WLR_LIBINPUT_NO_DEVICES": "1",
            "HOME": str(folder),
        }  # fmt: skip
        for name in ("DISPLAY", "WAYLAND_DISPLAY", "SWAYSOCK"):
            self._environment.pop(name, None)

    def start(self):
        config = self.folder / "config"
        config.write_text("default_border none\nxwayland disable\n")
        command = ["sway", "-c", str(config)]
        if os.geteuid() == 0:  # sway does not run for root
            os.chown(self.folder, NOBODY, NOBODY)
            command = [
                "setpriv",
                f"--reuid={NOBODY}",
                f"--regid={NOBODY}",
                "--clear-groups",
                *command,
            ]
        self._process = subprocess.Popen(
            command, env=self._environment, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL
        )
        self._environment["SWAYSOCK"] = str(
            wait_for(lambda: next(self.folder.glob("sway-ipc.*.sock"), None))
        )
        self.socket = wait_for(
            lambda: next((p for p in self.folder.glob("wayland-*") if p.suffix != ".lock"), None)
        )

    def message(self, *words):
        return json.loads(self.run("swaymsg", "-r", *words).stdout or "[]")

    def run(self, *words):
        environment = self._environment | {"WAYLAND_DISPLAY": self.socket.name}
        return subprocess.run(words, env=environment, check=True, capture_output=True)

    def names(self):
        return sorted(output["name"] for output in self.message("-t", "get_outputs"))

    def arrange(self, places):
        """Give each output a size and a place, by its number."""
        for name, (size, x) in zip(self.names(), places, strict=True):
            width, height = size
            self.message(f"output {name} mode {width}x{height} position {x} 0")

    def pixels(self, name):
        image = self.run("grim", "-o", name, "-t", "png", "-").stdout
        return np.asarray(Image.open(io.BytesIO(image)).convert("RGB"))

    def end(self):
        self._process.terminate()
        self._process.wait()


@pytest.fixture
def desktop(monkeypatch):
    """Run a desktop with two outputs that windows open on."""
    if not (shutil.which("sway") and shutil.which("grim")):
        pytest.skip("needs Debian's sway and grim")
    folder = Path(tempfile.mkdtemp(prefix="touchplate-desktop-"))  # within reach of other users
    running = Desktop(folder)
    running.start()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(folder))
    monkeypatch.setenv("WAYLAND_DISPLAY", running.socket.name)
    monkeypatch.setenv("SDL_VIDEODRIVER", "wayland")
    monkeypatch.delenv("DISPLAY", raising=False)
    try:
        yield running
    finally:
        running.end()
        shutil.rmtree(folder)


def shows(show, desktop, name):
    show(MARKS)
    return np.array_equal(desktop.pixels(name), draw_marks(MARKS, SCREEN))


@pytest.mark.slow
@pytest.mark.display
@pytest.mark.parametrize(
    "places",
    [[(LAPTOP, 0), (SIZE, 1368)], [(SIZE, 0), (LAPTOP, 1280)], [(LAPTOP, 1280), (SIZE, 0)]],
)
def test_the_projector_shows_its_pixels_and_the_laptop_none(desktop, places):
    desktop.arrange(places)
    sizes = [size for size, _ in places]
    projector, laptop = (desktop.names()[sizes.index(size)] for size in (SIZE, LAPTOP))
    with open_projector(SCREEN, None) as show:
        wait_for(partial(shows, show, desktop, projector))
        assert desktop.pixels(laptop).shape[:2] == LAPTOP[::-1]
        marked = draw_marks(MARKS, SCREEN).reshape(-1, 3).max(axis=0)
        assert not (desktop.pixels(laptop) == marked).all(axis=2).any()


def test_a_window_whose_output_is_unplugged_says_so_and_ends(monkeypatch):
    import pygame

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pygame.display.init()
    left = [laptop_first(), laptop_first(), laptop_first()[:1]]
    monkeypatch.setattr(outputs, "list_outputs", lambda: left.pop(0) if left[1:] else left[0])
    ours, theirs = multiprocessing.Pipe()
    canvas = SimpleNamespace(show=lambda content: None)
    try:
        process._follow(process._Loop(theirs, 1), canvas, "it is there", None, laptop_first()[1])
    finally:
        pygame.display.quit()
    assert ours.recv() == (True, "it is there", 1)
    ready, said, _ = ours.recv()
    assert not ready
    assert said == (
        "projector window is gone: output 'HDMI-1' is not there any more or has changed; plug it in"
        " again"
    )


def test_a_window_that_nobody_would_see_is_none(monkeypatch, tmp_path):
    for name in ("WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("DISPLAY", ":987")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with open_projector(SCREEN, None, full_screen=False) as show:
        wait_for(lambda: show(()) or not show.status.endswith("is opening"))
        assert show.status.startswith("no projector window: the display did not open (SDL would")

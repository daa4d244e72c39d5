"""The projector's window under a virtual X server, its pixels read from the server's own memory."""

import os
import select
import signal
import struct
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from rig.live.snapshot import Mark
from rig.projector import open_projector
from rig.projector.content import image_of
from rig.projector.markers import draw_marks, fit_plate, project
from rig.projector.window import Projector
from tests.waiting import wait_for

SIZE, PLATE = (640, 400), (254.0, 180.0)
SCREEN = fit_plate(SIZE, PLATE)
SECONDS = 20


@pytest.fixture
def x_server(tmp_path):
    """Run an X server of the projector's size; yield its display name and frame buffer file."""
    reading, writing = os.pipe()
    server = subprocess.Popen(
        ["/usr/bin/Xvfb", "-displayfd", str(writing), "-nolisten", "tcp", "-fbdir", str(tmp_path),
         "-screen", "0", f"{SIZE[0]}x{SIZE[1]}x24"],
        pass_fds=[writing], stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(writing)
    try:
        assert select.select([reading], [], [], SECONDS)[0], "Xvfb did not start"
        yield f":{os.read(reading, 16).decode().strip()}", tmp_path / "Xvfb_screen0"
    finally:
        os.close(reading)
        server.terminate()
        server.wait()


def read_screen(path: Path) -> np.ndarray:
    """Image (H, W, 3) RGB from an X window dump: a header of 32-bit words, colours, pixels."""
    dump = path.read_bytes()
    header = struct.unpack(">25I", dump[:100])
    height, stride, start = header[5], header[12], header[0] + 12 * header[19]
    pixels = np.frombuffer(dump, np.uint8, height * stride, start).reshape(height, -1, 4)
    return pixels[:, : header[4], 2::-1]


@pytest.mark.display
def test_the_window_shows_the_drawn_image_pixel_for_pixel(x_server):
    display, memory = x_server
    marks = (Mark(60.0, 50.0, 2.0, (3.0, 1.0, 0.4)), Mark(200.0, 120.0, 0.7))
    with open_projector(SCREEN, display) as show:
        drawn = draw_marks(marks, SCREEN)
        wait_for(lambda: show(marks) or (read_screen(memory) == drawn).all())
        assert show.status == f"projector window on {display} screen, 640 x 400 px"


@pytest.mark.display
def test_a_marker_is_lit_where_its_touch_is_and_follows_it(x_server):
    display, memory = x_server
    with open_projector(SCREEN, display) as show:
        for place in ((80.0, 60.0), (180.0, 110.0)):
            expected = project(SCREEN.T_px_plate, np.array([place]))[0]
            wait_for(partial(shows_at, show, memory, Mark(*place, 1.0), expected))
            light = read_screen(memory)[..., 1].astype(float)
            rows, columns = np.indices(light.shape)
            found = np.array([(columns * light).sum(), (rows * light).sum()]) / light.sum()
            assert np.abs(found - expected).max() < 1


def shows_at(show, memory, mark, expected):
    """Show the mark until its place is lit and the image has come to rest."""
    show((mark,))
    before = read_screen(memory)
    time.sleep(0.1)
    column, row = np.rint(expected).astype(int)
    return before[row, column].any() and (before == read_screen(memory)).all()


@pytest.mark.display
def test_an_image_is_shown_pixel_for_pixel_and_a_stuck_window_does_not_wait_for_it(x_server):
    display, memory = x_server
    pixels = np.random.default_rng(4).integers(0, 256, (SIZE[1], SIZE[0], 3), np.uint8)
    with open_projector(SCREEN, display) as show:
        image = image_of(pixels, SIZE)
        wait_for(lambda: show(image) or (read_screen(memory) == pixels).all())
        os.kill(show.pid, signal.SIGSTOP)
        for level in range(20):  # far more than any pipe holds
            show(image_of(np.full_like(pixels, level), SIZE))
            show(())
        os.kill(show.pid, signal.SIGCONT)
        last = image_of(pixels[::-1], SIZE)
        wait_for(lambda: show(last) or (read_screen(memory) == pixels[::-1]).all())


class AnsweringLink:
    """The loop's end of a link to a window that answers at once."""

    def __init__(self):
        self.sent, self._answers = [], 1  # a window that has opened says so

    def poll(self):
        return self._answers > 0

    def recv(self):
        self._answers -= 1
        return True, "shown", None

    def send(self, content):
        self.sent.append(content)
        self._answers += 1


def test_an_image_that_stays_is_sent_once_and_its_window_is_not_taken_for_stuck(monkeypatch):
    monkeypatch.setattr("rig.projector.window.SECONDS_TO_ANSWER", 0.0)
    link = AnsweringLink()
    projector = Projector(lambda wanted: (link, Mock()), "nowhere")
    image = image_of(np.zeros((SIZE[1], SIZE[0]), np.uint8), SIZE)
    for _ in range(5):
        projector(image)
    assert (projector.alive, projector.status) == (True, "shown")
    assert link.sent == [image]


@pytest.mark.display
def test_a_screen_of_another_size_is_refused_in_one_sentence(x_server):
    display, _ = x_server
    with open_projector(fit_plate((800, 600), PLATE), display) as show:
        wait_for(lambda: show(()) or "no projector window" in show.status)
        assert show.status == (
            "no projector window: no output has the projector's 800 x 600 px; set projector.size to"
            " that of its output, or projector.output: there are 0 'screen' of 640 x 400 px at 0, 0"
        )


@pytest.mark.slow
@pytest.mark.display
def test_a_stuck_window_never_holds_the_loop(x_server):
    display, memory = x_server
    marks = (Mark(60.0, 50.0, 2.0),)
    with open_projector(SCREEN, display) as show:
        wait_for(lambda: show(marks) or read_screen(memory).any())
        os.kill(show.pid, signal.SIGSTOP)
        for _ in range(20000):  # far more than any pipe holds
            show(marks)
    assert not Path(f"/proc/{show.pid}").exists()


@pytest.mark.slow
@pytest.mark.display
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_window_that_dies_or_hangs_is_opened_again(x_server, how, monkeypatch):
    monkeypatch.setattr("rig.projector.window.SECONDS_TO_RETRY", 0.2)
    monkeypatch.setattr("rig.projector.window.SECONDS_TO_ANSWER", 0.5)
    display, memory = x_server
    marks = (Mark(60.0, 50.0, 2.0),)
    sound = f"projector window on {display} screen, 640 x 400 px"
    with open_projector(SCREEN, display) as show:
        wait_for(lambda: show(marks) or read_screen(memory).any())
        first = show.pid
        os.kill(first, how)
        wait_for(lambda: show(marks) or not show.alive)
        assert "it is opened again" in show.status
        # A window that hangs leaves its image on the screen: only the new one's word counts.
        wait_for(lambda: show(marks) or (show.status == sound and read_screen(memory).any()))
        assert show.pid != first
        assert not Path(f"/proc/{first}").exists()


def test_who_needs_the_window_waits_for_it_or_learns_why_there_is_none():
    with (
        open_projector(SCREEN, ":4094") as show,
        pytest.raises(OSError, match="no projector window: :4094 did not open"),
    ):
        show.wait(SECONDS)


def test_no_display_is_a_sentence_and_the_loop_goes_on():
    with open_projector(SCREEN, ":4094") as show:
        wait_for(lambda: show((Mark(60.0, 50.0, 2.0),)) or "no projector window" in show.status)
        assert ":4094 did not open" in show.status
        show(())


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [0.0, 0.1, 0.2, 0.4])
def test_ctrl_c_ends_loop_and_window_without_a_word(tmp_path, seconds):
    script = """
import signal, time
from rig.projector.markers import fit_plate
from rig.projector import open_projector
from rig.projector.content import image_of
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
    try:
        with open_projector(fit_plate((640, 400), (254.0, 180.0)), ":4094") as show:
            print("open", flush=True)
            while True:
                show(())
                time.sleep(0.01)
    except KeyboardInterrupt:
        print("end", flush=True)
"""
    file = tmp_path / "loop.py"
    file.write_text(script)
    with subprocess.Popen(
        [sys.executable, file],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    ) as loop:
        assert loop.stdout is not None
        assert loop.stdout.readline() == "open\n"
        time.sleep(seconds)
        os.killpg(loop.pid, signal.SIGINT)
        assert loop.communicate(timeout=SECONDS)[0] == "end\n"


@pytest.mark.slow
@pytest.mark.display
def test_the_window_ends_when_its_loop_is_killed(x_server):
    display, memory = x_server
    script = f"""
import time
from rig.projector.markers import fit_plate
from rig.projector import open_projector
from rig.projector.content import image_of
from rig.live.snapshot import Mark
if __name__ == "__main__":
    with open_projector(fit_plate({SIZE}, {PLATE}), {display!r}) as show:
        print(show.pid, flush=True)
        while True:
            show((Mark(60.0, 50.0, 2.0),))
            time.sleep(0.02)
"""
    file = memory.parent / "loop.py"
    file.write_text(script)
    with subprocess.Popen([sys.executable, file], stdout=subprocess.PIPE, text=True) as loop:
        assert loop.stdout is not None
        window = int(loop.stdout.readline())
        wait_for(lambda: read_screen(memory).any())
        loop.kill()
    wait_for(lambda: not Path(f"/proc/{window}").exists() or is_zombie(window))


def is_zombie(pid: int) -> bool:
    return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"

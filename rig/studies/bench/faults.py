"""What goes wrong on a bench: each fault, what the user sees, and how soon the touch is back.

Parts: faults. See `emulated`. One finger presses all the time; a fault happens, is undone, and the
time counts from then until the touch is found again, three frames in a row within 8 mm. Any other
touch that is reported meanwhile is a false one. A disk that is full is a limit on the size of the
app's files. The clock that jumps is the camera's; the loop itself reads the monotonic clock alone,
which no setting of the date moves.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import numpy as np
from websockets.sync.client import connect

import synthetic
from rig.calibration import store
from rig.recording.session import open_session
from rig.report.figure import Figure
from rig.studies.bench.emulated import touchplate
from rig.studies.bench.fault_bench import (
    BACK,
    HOLD,
    NONE,
    TABLE,
    Bench,
    command_of,
    nothing,
    wait,
)
from rig.studies.study import line, part, run

SIZE = 512  # px
AWAY = 0.4  # s that a device is away while it is reset


def of_the_camera(bench: Bench) -> Iterator[Figure]:
    """Faults of the camera and its cable."""
    say, episode = bench.camera.say, bench.episode
    for fault, make, undo, hold in (
        ("camera unplugged, plugged in again", "unplug", "plug", HOLD),
        ("camera freezes", "freeze", "thaw", HOLD),
        ("USB reset of the camera", "unplug", "plug", AWAY),
        ("five frames dropped", "skip", "", HOLD),
        ("a torn frame", "tear", "", HOLD),
        ("clock of the camera jumps by an hour", "clock:3600", "", HOLD),
    ):
        yield from episode(fault, partial(say, make), partial(say, undo) if undo else nothing, hold)
    say("clock:0")


def of_the_light(bench: Bench) -> Iterator[Figure]:
    """Faults of light and view."""
    room = bench.room
    ending = threading.Event()

    def flicker() -> None:
        while not ending.wait(0.04):
            room.lamp = 2.1 - room.lamp if room.lamp != 1.0 else 1.1

    def switch(level: float) -> Callable[[], object]:
        return lambda: setattr(room, "lamp", level)

    side = float(bench.size)
    arm = np.array([(0.5, -0.1), (1.1, -0.1), (1.1, 1.1), (0.5, 1.1)]) * side
    hidden = synthetic.Occluder(arm, 0.4).coverage((bench.size, bench.size)).astype(np.float32)

    def cover(light: np.ndarray) -> np.ndarray:
        return light + hidden * (np.float32(0.4) - light)

    clear, thread = room.cover, threading.Thread(target=flicker, daemon=True)
    yield from bench.episode(
        "light flickers by 10 %", thread.start, lambda: (ending.set(), switch(1.0)())
    )
    yield from bench.episode("light switched off, and on again", switch(0.02), switch(1.0))
    hide, show = (partial(setattr, room, "cover", each) for each in (cover, clear))
    yield from bench.episode("hand over half the pattern", hide, show)
    bump = partial(setattr, room, "shift", (3.0, 1.0))
    yield from bench.episode("camera bumped by 3 px, and left so", bump, nothing)


def of_the_projector(bench: Bench) -> Iterator[Figure]:
    """Faults of the projector and its window."""

    def kill(how: signal.Signals) -> Callable[[], object]:
        return lambda: [os.kill(pid, how) for pid in bench.windows()]

    display = bench.display
    for fault, make, undo in (
        ("projector unplugged, plugged in again", display.unplug, display.plug),
        ("kill -9 of the projector's window", kill(signal.SIGKILL), nothing),
        ("projector's window hangs", kill(signal.SIGSTOP), nothing),
    ):
        yield from bench.projector(fault, make, undo)


def of_the_clients(bench: Bench) -> Iterator[Figure]:
    """Let twenty pages ask and never read."""
    with ExitStack() as clients:

        def crowd() -> None:
            for _ in range(20):
                page = f"ws://127.0.0.1:{bench.page}/stream"
                client = clients.enter_context(connect(page, max_queue=1, close_timeout=0.1))
                for _ in range(20):
                    client.send("camera strain")

        yield from bench.episode("twenty page clients that never read", crowd, nothing, 4.0)


def of_the_disk(bench: Bench) -> Iterator[Figure]:
    """Fill the disk; then see what the recording holds once the app has ended."""

    def fill() -> None:
        size = bench.record.stat().st_size
        resource.prlimit(bench.app.pid, resource.RLIMIT_FSIZE, (size, size))

    yield from bench.episode("disk full while recording", fill, nothing)
    bench.app.send_signal(signal.SIGINT)
    out, _ = bench.app.communicate(timeout=60)
    said = json.loads(out[out.index("{") :])
    with open_session(bench.record) as session:
        kept = session.frames
    recorded = said["recorded"]
    status = recorded["status"].replace(f"{bench.folder}/", "")
    yield from line(
        TABLE,
        "the recording of all of that",
        what_the_user_sees=f"“{status}”",
        lost=(recorded["frames"] - kept, "frames written", NONE, recorded["frames"]),
        left_out=(recorded["dropped"], "frames after the disk was full"),
    )


def of_the_app(bench: Bench) -> Iterator[Figure]:
    """Kill the app while it records; what is on disk must open."""
    record = bench.folder / "killed.h5"
    bench.room.rest()
    time.sleep(0.5)
    app = touchplate(
        bench.camera, "run", bench.scene, "--record", record, stderr=subprocess.DEVNULL
    )
    since = time.monotonic()
    wait(lambda: len(bench.heard(since)) > 40, 60)
    window = [
        int(pid)
        for pid in Path(f"/proc/{app.pid}/task/{app.pid}/children").read_text().split()
        if "spawn_main" in command_of(int(pid))
    ]
    app.kill()
    app.wait()
    heard = len(bench.heard(since))
    gone = wait(lambda: not any(command_of(pid) for pid in window), 5)
    with open_session(record) as session:
        kept, cut = session.frames, session.cut
    yield from line(
        TABLE,
        "kill -9 of the app while it records",
        what_the_user_sees=f"the command has ended; the file {cut or 'is whole'}",
        kept=(kept, f"frames of {heard} reported"),
        left_behind=(0 if gone else 1, "windows", NONE),
    )


def of_the_twin() -> Iterator[Figure]:
    """Kill the process of the twin under a run of it."""
    small = [
        "plate.size=[254, 203]", "camera.pixels=[384, 320]", "pattern.diameter=3.5", "dic.tile=8",
        "dic.subset=25", "estimator.modes=100",
    ]  # fmt: skip
    settings = [f"--set={one}" for one in small]
    command = [
        sys.executable,
        "-c",
        "from rig.cli import main; main()",
        "run",
        "twin",
        "--headless",
    ]
    app = subprocess.Popen(command + settings, stderr=subprocess.PIPE, text=True)
    for said in iter(part(app.stderr).readline, ""):
        if "reference" in said:
            break
    time.sleep(6.0)
    children = Path(f"/proc/{app.pid}/task/{app.pid}/children").read_text().split()
    began = time.monotonic()
    for pid in map(int, children):
        if "spawn_main" in command_of(pid):
            os.kill(pid, signal.SIGKILL)
    last = " ".join(app.communicate(timeout=60)[1].split())
    ends = time.monotonic() - began, "s", BACK
    yield from line(
        TABLE, "kill -9 of the twin", what_the_user_sees=f"“{last[-160:]}”", ends_after=ends
    )


def of_the_start(bench: Bench) -> Iterator[Figure]:
    """Start with something wrong."""
    kept = store.beside(bench.scene)
    fresh = kept.read_text()
    year = str(datetime.now(UTC).year)
    kept.write_text(fresh.replace(f'"{year}-', f'"{int(year) - 2}-'))
    yield from start(bench, "stale calibration", ["--frames=5", "--headless"])
    kept.write_text(fresh)
    half = bench.size // 2
    wrongs = {
        "camera gives another size of image": [f"--set=camera.pixels=[{half}, {half}]"],
        "exposure refused": ["--set=source.exposure=9 s", "--frames=5", "--headless"],
        "wrong scene: a key that does not exist": ["--set=camera.pixel=[512, 512]"],
        "port in use": [f"--set=outputs.websocket.port={busy_port()}", "--frames=5"],
    }
    for fault, arguments in wrongs.items():
        yield from start(bench, fault, arguments)
    bench.camera.say("busy")
    yield from start(bench, "camera in use by another program", ["--headless"])
    bench.camera.say("free")


def start(bench: Bench, fault: str, arguments: list[str]) -> Iterator[Figure]:
    """Start the app with something wrong; what it says, and whether it goes on."""
    app = touchplate(bench.camera, "run", bench.scene, "--json", *arguments)
    try:
        _, said = app.communicate(timeout=90)
    except subprocess.TimeoutExpired:
        app.kill()
        _, said = app.communicate()
    lines = " ".join(said.split()).split("the source gets ready")[0]
    lines = lines.split("linear theory, as the scene insists")[0].split("(Ctrl-C ends)")[-1]
    lines = lines.replace(f"{bench.folder}/", "").strip()
    ends = "goes on" if app.returncode == 0 else f"ends with code {app.returncode}"
    yield from line(
        TABLE,
        fault,
        what_the_user_sees=f"“{lines[:260]}”",
        then=ends,
        without_a_word=(0 if lines else 1, "starts", NONE),
    )


HELD = socket.socket()


def busy_port() -> int:
    """Take a port and keep it."""
    HELD.bind(("127.0.0.1", 0))
    HELD.listen()
    return HELD.getsockname()[1]


def faults() -> Iterator[Figure]:
    """Let everything go wrong, one after the other."""
    with tempfile.TemporaryDirectory() as name, ExitStack() as parts:
        bench = Bench(Path(name), SIZE, parts)
        bench.start()
        for step in (of_the_camera, of_the_light, of_the_projector, of_the_clients, of_the_disk):
            yield from step(bench)
        yield from of_the_app(bench)
        yield from of_the_twin()
        yield from of_the_start(bench)


PARTS = {"faults": faults}

if __name__ == "__main__":
    run(PARTS, __doc__)

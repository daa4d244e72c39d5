"""What goes wrong on a bench: each fault, what the user sees, and how soon the touch is back.

    python benchmarks/faults.py [--size 512]

See `emulated_bench`. One finger presses all the time; a fault happens, is undone, and the time
counts from then until the touch is found again, three frames in a row within 8 mm. Any other touch
that is told meanwhile is a false one. A disk that is full is a limit on the size of the app's
files. The clock that jumps is the camera's; the loop itself reads the monotonic clock alone, which
no setting of the date moves.
"""

from __future__ import annotations

import argparse
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
from pathlib import Path

import numpy as np
from websockets.sync.client import connect

import synthetic
from rig.calibration import store
from rig.recording.session import open_session
from rig.studies.bench.emulated import touchplate
from rig.studies.bench.fault_bench import Bench, Row, command_of, nothing, wait

SIZE = 512  # px
AWAY = 0.4  # s that a device is away while it is reset


def of_the_camera(bench: Bench) -> list[Row]:
    """Faults of the camera and its cable."""
    say, episode = bench.camera.say, bench.episode
    rows = [
        episode("camera unplugged, plugged in again", lambda: say("unplug"), lambda: say("plug")),
        episode("camera freezes", lambda: say("freeze"), lambda: say("thaw")),
        episode("USB reset of the camera", lambda: say("unplug"), lambda: say("plug"), AWAY),
        episode("five frames dropped", lambda: say("skip"), nothing),
        episode("a torn frame", lambda: say("tear"), nothing),
        episode("clock of the camera jumps by an hour", lambda: say("clock:3600"), nothing),
    ]
    say("clock:0")
    return rows


def of_the_light(bench: Bench) -> list[Row]:
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
    hidden = synthetic.Hand(arm, 0.4).share((bench.size, bench.size)).astype(np.float32)

    def cover(light: np.ndarray) -> np.ndarray:
        return light + hidden * (np.float32(0.4) - light)

    clear, thread = room.cover, threading.Thread(target=flicker, daemon=True)
    return [
        bench.episode(
            "light flickers by 10 %", thread.start, lambda: (ending.set(), switch(1.0)())
        ),
        bench.episode("light switched off, and on again", switch(0.02), switch(1.0)),
        bench.episode(
            "hand over half the pattern",
            lambda: setattr(room, "cover", cover),
            lambda: setattr(room, "cover", clear),
        ),
        bench.episode(
            "camera bumped by 3 px, and left so",
            lambda: setattr(room, "shift", (3.0, 1.0)),
            nothing,
        ),
    ]


def of_the_projector(bench: Bench) -> list[Row]:
    """Faults of the projector and its window."""

    def kill(how: signal.Signals) -> Callable[[], object]:
        return lambda: [os.kill(pid, how) for pid in bench.windows()]

    display = bench.display
    return [
        bench.projector("projector unplugged, plugged in again", display.unplug, display.plug),
        bench.projector("kill -9 of the projector's window", kill(signal.SIGKILL), nothing),
        bench.projector("projector's window hangs", kill(signal.SIGSTOP), nothing),
    ]


def of_the_clients(bench: Bench) -> Row:
    """Let twenty pages ask and never read."""
    with ExitStack() as clients:

        def crowd() -> None:
            for _ in range(20):
                page = f"ws://127.0.0.1:{bench.page}/stream"
                client = clients.enter_context(connect(page, max_queue=1, close_timeout=0.1))
                for _ in range(20):
                    client.send("camera strain")

        return bench.episode("twenty page clients that never read", crowd, nothing, 4.0)


def of_the_disk(bench: Bench) -> tuple[Row, Row]:
    """Fill the disk; then see what the recording holds once the app has ended."""

    def fill() -> None:
        size = bench.record.stat().st_size
        resource.prlimit(bench.app.pid, resource.RLIMIT_FSIZE, (size, size))

    row = bench.episode("disk full while recording", fill, nothing)
    bench.app.send_signal(signal.SIGINT)
    out, _ = bench.app.communicate(timeout=60)
    said = json.loads(out[out.index("{") :])
    with open_session(bench.record) as session:
        kept = session.frames
    recorded = said["recorded"]
    status = recorded["status"].replace(f"{bench.folder}/", "")
    row = Row(row.fault, f"“{status}”", row.back, row.false)
    kept_row = Row(
        "the recording of all of that",
        f"{kept} of {recorded['frames']} frames that were written are read again",
        "–",
        f"{recorded['dropped']} left out, those after the disk was full",
    )
    return row, kept_row


def of_the_app(bench: Bench) -> Row:
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
    told = len(bench.heard(since))
    gone = wait(lambda: not any(command_of(pid) for pid in window), 5)
    with open_session(record) as session:
        kept, cut = session.frames, session.cut
    return Row(
        "kill -9 of the app while it records",
        f"the command has ended; of {told} frames told {kept} are in the file {cut}".strip(),
        "start it again",
        "its window has ended with it" if gone else "its window is left behind",
    )


def of_the_twin() -> Row:
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
    lines = iter(app.stderr.readline, "")
    for line in lines:
        if "reference" in line:
            break
    time.sleep(6.0)
    children = Path(f"/proc/{app.pid}/task/{app.pid}/children").read_text().split()
    began = time.monotonic()
    for pid in map(int, children):
        if "spawn_main" in command_of(pid):
            os.kill(pid, signal.SIGKILL)
    said = app.communicate(timeout=60)[1]
    last = " ".join(said.split())
    return Row(
        "kill -9 of the twin", f"“{last[-160:]}”", f"ends in {time.monotonic() - began:.1f} s", "–"
    )


def of_the_start(bench: Bench) -> list[Row]:
    """Start with something wrong."""
    kept = store.beside(bench.scene)
    fresh = kept.read_text()
    year = str(datetime.now(UTC).year)
    kept.write_text(fresh.replace(f'"{year}-', f'"{int(year) - 2}-'))
    rows = [start(bench, "stale calibration", ["--frames=5", "--headless"])]
    kept.write_text(fresh)
    half = bench.size // 2
    wrongs = {
        "camera gives another size of picture": [f"--set=camera.pixels=[{half}, {half}]"],
        "exposure refused": ["--set=source.exposure=9 s", "--frames=5", "--headless"],
        "wrong scene: a key that does not exist": ["--set=camera.pixel=[512, 512]"],
        "port in use": [f"--set=outputs.websocket.port={busy_port()}", "--frames=5"],
    }
    rows += [start(bench, fault, arguments) for fault, arguments in wrongs.items()]
    bench.camera.say("busy")
    rows.append(start(bench, "camera in use by another program", ["--headless"]))
    bench.camera.say("free")
    return rows


def start(bench: Bench, fault: str, arguments: list[str]) -> Row:
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
    return Row(fault, f"“{lines[:260]}”", ends, "–")


HELD = socket.socket()


def busy_port() -> int:
    """Take a port and keep it."""
    HELD.bind(("127.0.0.1", 0))
    HELD.listen()
    return HELD.getsockname()[1]


def rows(size: int) -> Iterator[Row]:
    """Let everything go wrong, one after the other."""
    with tempfile.TemporaryDirectory() as name, ExitStack() as parts:
        bench = Bench(Path(name), size, parts)
        bench.start()
        for step in (of_the_camera, of_the_light, of_the_projector):
            yield from step(bench)
        yield of_the_clients(bench)
        yield from of_the_disk(bench)
        yield of_the_app(bench)
        yield of_the_twin()
        yield from of_the_start(bench)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--size", type=int, default=SIZE)
    for row in rows(options.parse_args().size):
        print(f"{row.fault:42} {row.back:10} {row.false:20} {row.sees}", flush=True)


if __name__ == "__main__":
    main()

"""A replay that runs for hours: memory, descriptors, and whether its recordings are whole.

Parts: short, two_hours. `touchplate run` of a recording of the twin with a small camera, played
over and over at twice its pace, with its page open to a viewer who takes each image, with outputs
by OSC, TUIO and websocket, and with a recording that is ended and begun anew from the page. Memory
and descriptors are those of the program: the median of the first `WINDOW` seconds after the
warm-up, and of the last. *Lost* are frames that a recording lacks between its first and its last.
"""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from rig.recording.playback import Playback
from rig.recording.session import open_session
from rig.report.figure import Bar, Figure, at_most
from rig.studies.study import line, run
from rig.system.frame import Frame

TABLE = "A replay at twice its pace, with page, outputs and recording"
SMALL = {
    "plate.size": "[254, 203]",
    "camera.pixels": "[384, 320]",
    "pattern.diameter": "3.5",
    "dic.tile": "8",
    "dic.subset": "25",
    "estimator.modes": "100",
    "estimator.bench": "exact",
    "page.viewers": "machine",
    "page.port": "0",
}
OUTPUTS = {"outputs.osc.port": "9123", "outputs.tuio.port": "9124", "outputs.websocket.port": "0"}
KEPT, FASTER = 750, 2.0  # frames of the tour, 25 s; and how much faster they are played
WARM, WINDOW, STEP = 45.0, 30.0, 1.0  # s
EACH = 60.0  # s of a recording
BARS: dict[str, Bar | None] = {
    "memory_grows_by": at_most(2),
    "further_descriptors": at_most(0),
    "lost": at_most(0),
}
PROGRAM = "import sys; from rig.studies.bench.soak import main; main(sys.argv[1:])"
CLI = "from rig.cli import main; main()"


class Repeated(Playback):
    """A recording that is played over and over, faster than it was taken."""

    def __init__(self, session: Any):
        super().__init__(session)
        self._captured = self._captured / FASTER
        self._given = 0

    def grab(self, timeout: float) -> Frame | None:
        """See `Source.grab`; it has no end, and its numbers go on."""
        if self._next == self._session.frames:
            self._next, self._ahead = 0, None
        frame = super().grab(timeout)
        if frame is None:
            return None
        self._given += 1
        return replace(frame, sequence=self._given)


def main(words: list[str]) -> None:
    """Run `touchplate` with recordings that are played over and over."""
    from rig.cli import application
    from rig.recording import playback

    playback.Playback = Repeated
    application(words)(words)


@dataclass
class Watched:
    """What was seen of the program: at which s, MB and descriptors."""

    pid: int
    times: list[float] = field(default_factory=list[float])
    memory: list[float] = field(default_factory=list[float])
    descriptors: list[int] = field(default_factory=list[int])

    def look(self, time: float) -> None:
        """Look once."""
        status = Path(f"/proc/{self.pid}/status").read_text(encoding="utf-8")
        kilobytes = int(status.partition("VmRSS:")[2].split()[0])
        self.times.append(time)
        self.memory.append(kilobytes / 1024)
        self.descriptors.append(len(list(Path(f"/proc/{self.pid}/fd").iterdir())))

    def between(self, start: float, end: float) -> tuple[float, float]:
        """Median memory, MB, and descriptors from `start` to `end` s."""
        kept = [k for k, time in enumerate(self.times) if start <= time <= end]
        return median(self.memory[k] for k in kept), median(self.descriptors[k] for k in kept)


def short() -> Iterator[Figure]:
    """Run for five minutes, which have no verdict."""
    yield from soak("five minutes", 300.0, dict.fromkeys(BARS))


def two_hours() -> Iterator[Figure]:
    """Run for two hours."""
    yield from soak("two hours", 7200.0, BARS)


def soak(name: str, seconds: float, bars: Mapping[str, Bar | None]) -> Iterator[Figure]:
    """Let it run for some seconds."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "played.h5"
        _record(source)
        recordings = Path(folder) / "new"
        recordings.mkdir()
        with program(source, recordings) as (process, page, stream):
            ending = threading.Event()
            viewers = [
                threading.Thread(target=viewer, args=(*each, ending))
                for each in ((f"ws{page[4:]}stream", "camera:600 strain"), (stream, None))
            ]
            for one in viewers:
                one.start()
            watched, whole = _watch(process, page, recordings, seconds)
            ending.set()
            process.send_signal(signal.SIGINT)
            said = json.loads(process.communicate(timeout=60)[0])
            for one in viewers:
                one.join()
        files, lost = whole
        for path in sorted(recordings.glob("*.h5")):  # the one that ran at the end
            files, lost = files + 1, lost + missing(path)
    before, after = watched.between(WARM, WARM + WINDOW), watched.between(seconds - WINDOW, seconds)
    looks = len(watched.times)
    yield from line(
        TABLE,
        name,
        memory_grows_by=(100.0 * (after[0] / before[0] - 1.0), "%", bars["memory_grows_by"], looks),
        further_descriptors=(after[1] - before[1], "", bars["further_descriptors"], looks),
        lost=(float(lost), "frames", bars["lost"], said["frames"]),
        recordings=(float(files), ""),
        memory=(before[0], "MB"),
        descriptors=(before[1], ""),
        rate=(said["fps"], "frames/s"),
        minutes=(seconds / 60.0, ""),
    )


def _watch(
    process: subprocess.Popen[str], page: str, folder: Path, seconds: float
) -> tuple[Watched, tuple[int, int]]:
    """Look at the program, and end and begin recordings; how many, and frames that they lack."""
    watched, began, turned = Watched(process.pid), time.monotonic(), 0
    files, lost = 0, 0
    ask(page, "record")
    while (age := time.monotonic() - began) < seconds:
        watched.look(age)
        if age > (turned + 1) * EACH and age < seconds - WINDOW:
            turned += 1
            ask(page, "record")
            time.sleep(2.0)
            for path in folder.glob("*.h5"):
                files, lost = files + 1, lost + missing(path)
                path.unlink()
            ask(page, "record")
        time.sleep(STEP)
    return watched, (files, lost)


def missing(path: Path) -> int:
    """Count frames between the first and the last one of a recording that it lacks."""
    with open_session(path) as session:
        if session.cut or not session.frames:
            return max(session.frames, 1)
        sequences = np.array([session.row(k)["frames/sequence"] for k in (0, session.frames - 1)])
        return int(sequences[1] - sequences[0]) + 1 - session.frames


def ask(page: str, what: str) -> None:
    """Ask for something as the page does."""
    body = json.dumps({"do": what}).encode()
    request = urllib.request.Request(
        f"{page}ask", body, {"Content-Type": "application/json", "Origin": page.rstrip("/")}
    )
    with urllib.request.urlopen(request, timeout=10):
        pass


def viewer(address: str, wanted: str | None, ending: threading.Event) -> None:
    """Take all that a page or a stream gives, until the end."""
    with (
        suppress(OSError, WebSocketException, TimeoutError),
        connect(address, max_size=None) as link,
    ):
        while not ending.is_set():
            if wanted is not None:
                link.send(wanted)
                for _ in json.loads(link.recv(timeout=20))["parts"]:
                    link.recv(timeout=20)
            else:
                link.recv(timeout=20)


def _record(path: Path) -> None:
    """Keep a tour of the twin."""
    words = ["run", "twin", f"--frames={KEPT}", "--headless", f"--record={path}"]
    words += [f"--set={key}={value}" for key, value in SMALL.items()]
    subprocess.run([sys.executable, "-c", CLI, *words], check=True, capture_output=True)


@contextmanager
def program(source: Path, folder: Path) -> Generator[tuple[subprocess.Popen[str], str, str]]:
    """Play a recording in a folder; gives the program, and the addresses of page and stream."""
    settings = SMALL | OUTPUTS | {"source": f'{{kind = "recording", path = "{source}"}}'}
    words = ["run", "twin", "--json", *(f"--set={key}={value}" for key, value in settings.items())]
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *words],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=folder,
    )  # fmt: skip
    try:
        said = ""
        while not (found := _addresses(said)):
            said += (process.stderr.readline() if process.stderr else "") or sys.exit(said)
        rest: Callable[[], object] = process.stderr.read if process.stderr else str
        threading.Thread(target=rest, daemon=True).start()
        yield process, *found
    finally:
        process.kill()
        process.wait()


def _addresses(said: str) -> tuple[str, str] | None:
    """Find the addresses of page and stream in what the program has said."""
    page, stream = re.search(r"http://\S+/", said), re.search(r"ws://\S+", said)
    return (page[0], stream[0]) if page and stream else None


PARTS = {"short": short, "two_hours": two_hours}

if __name__ == "__main__":
    run(PARTS, __doc__)

"""A hostile network: idle connections, readers that never read, requests that never end.

Parts: some, all. `touchplate run twin` with a small camera and its page open to the network, with
the usual limit of 1024 descriptors, on the machine that floods it as well. A viewer asks for every
frame meanwhile, by the link. *Lost* are frames that the loop left out; *longest wait* is that of
the viewer for a frame, *newcomer* the time of one who opens the page meanwhile until a frame comes.
"""

from __future__ import annotations

import json
import re
import resource
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from math import inf
from typing import Any

from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

from rig.report.figure import Figure, at_most
from rig.studies.study import line, run

TABLE = "A hostile network"
SMALL = {
    "plate.size": "[254, 203]",
    "camera.pixels": "[384, 320]",
    "pattern.diameter": "3.5",
    "dic.tile": "8",
    "dic.subset": "25",
    "estimator.modes": "100",
    "page.viewers": "network",
    "page.port": "0",
}
LIMIT = 1024  # descriptors of the program
WINDOW = 10.0  # s that a flood lasts once it has come
START = (
    "import resource as r; r.setrlimit(r.RLIMIT_NOFILE, (%d, %d)); from rig.cli import main; main()"
)
Flood = Callable[[int, str, ExitStack], None]


@dataclass
class Viewer:
    """One who asks for every frame by the link, and notes what he gets."""

    port: int
    token: str
    waits: list[float] = field(default_factory=list[float])
    lost: int = 0
    ending: threading.Event = field(default_factory=threading.Event)

    def watch(self) -> None:
        """Look until the end."""
        began = time.monotonic()
        while not self.ending.is_set():
            with suppress(OSError, WebSocketException, TimeoutError), self.page() as page:
                while not self.ending.is_set():
                    page.send("")
                    header: dict[str, Any] = json.loads(page.recv(timeout=20))
                    self.lost = int(header["dropped"])
                    self.waits.append(time.monotonic() - began)
                    began = time.monotonic()

    def page(self) -> ClientConnection:
        """Open the page's stream."""
        address = f"ws://127.0.0.1:{self.port}/stream?token={self.token}"
        return connect(address, max_size=None, open_timeout=20, close_timeout=0.1)


@contextmanager
def program() -> Generator[tuple[int, str]]:
    """Run the program; gives the port and the token of its page."""
    words = ["run", "twin", *(f"--set={key}={value}" for key, value in SMALL.items())]
    command = [sys.executable, "-c", START % (LIMIT, LIMIT), *words]
    process = subprocess.Popen(
        command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
    )
    said = ""
    try:
        while not (link := re.search(r":(\d+)/\s*\?token=([\w-]+)", said)):
            said += (process.stderr.readline() if process.stderr else "") or sys.exit(said)
        threading.Thread(target=process.stderr.read, daemon=True).start()  # pyright: ignore
        yield int(link[1]), link[2]
    finally:
        process.terminate()
        process.wait(30)


def idle(count: int, port: int, token: str, stack: ExitStack) -> None:
    """Connect all at once and say nothing."""
    for _ in range(count):
        one = stack.enter_context(socket.socket())
        one.setblocking(False)
        one.connect_ex(("127.0.0.1", port))


def slow_headers(count: int, port: int, token: str, stack: ExitStack) -> None:
    """Begin a request and never end it."""
    for _ in range(count):
        with suppress(OSError):
            one = stack.enter_context(socket.create_connection(("127.0.0.1", port), 2.0))
            one.sendall(b"GET / HTTP/1.1\r\nHost: bench\r\nX-Slow: ")


def readers(count: int, port: int, token: str, stack: ExitStack) -> None:
    """Come by the link, ask for a hundred images, and read none."""
    for _ in range(count):
        with suppress(OSError):
            one = stack.enter_context(socket.create_connection(("127.0.0.1", port), 2.0))
            one.sendall(
                f"GET /stream?token={token} HTTP/1.1\r\nHost: bench\r\nUpgrade: websocket\r\n"
                "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
            )
            one.sendall(_asked() * 100)


def _asked() -> bytes:
    """Return a masked text frame that asks for the camera's image."""
    text = b"camera"
    return bytes((0x81, 0x80 | len(text), 0, 0, 0, 0)) + text


def nobody(port: int, token: str, stack: ExitStack) -> None:
    """Flood with nothing."""


def flooded(floods: dict[str, Flood]) -> Iterator[Figure]:
    """Let each flood come while a viewer looks."""
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    with program() as (port, token):
        viewer = Viewer(port, token)
        looking = threading.Thread(target=viewer.watch)
        looking.start()
        while len(viewer.waits) < 100:
            time.sleep(0.1)
        for name, flood in floods.items():
            yield from _episode(name, flood, viewer)
        viewer.ending.set()
        looking.join()


def _episode(name: str, flood: Flood, viewer: Viewer) -> Iterator[Figure]:
    first, lost, began = len(viewer.waits), viewer.lost, time.monotonic()
    with ExitStack() as stack:
        flood(viewer.port, viewer.token, stack)
        came = time.monotonic()
        new = _newcomer(viewer)
        time.sleep(max(0.0, came + WINDOW - time.monotonic()))
        waits = viewer.waits[first:] or [time.monotonic() - began]
    seconds = time.monotonic() - began
    return line(
        TABLE,
        name,
        lost=(viewer.lost - lost, "frames", at_most(0), round(30 * seconds)),
        longest_wait=(max(waits), "s", at_most(5)),
        frames_seen=(len(waits) / seconds, "frames/s"),
        newcomer=(new, "s", at_most(5)),
    )


def _newcomer(viewer: Viewer) -> float:
    began = time.monotonic()
    with suppress(OSError, WebSocketException, TimeoutError), viewer.page() as page:
        page.send("camera")
        page.recv(timeout=20)
        return time.monotonic() - began
    return inf


def floods(part: float) -> dict[str, Flood]:
    """Give the floods, or a part of each."""
    many, some, few = (round(part * count) for count in (10_000, 500, 500))
    return {
        "nobody": nobody,
        f"{many} idle connections": partial(idle, many),
        f"{some} readers that never read": partial(readers, some),
        f"{few} requests that never end": partial(slow_headers, few),
    }


PARTS = {
    "some": lambda: flooded(floods(0.05)),
    "all": lambda: flooded(floods(1.0)),
}

if __name__ == "__main__":
    run(PARTS, __doc__)

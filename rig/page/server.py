"""Serve the page on a loopback port from a thread beside the live loop.

A page asks for each frame when it has done with the last, and gets the newest then. So a slow
page sees fewer frames, nothing queues, and the loop only ever leaves its newest snapshot behind.
"""

import asyncio
import errno
import os
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.routing import Mount, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from rig.markers import Screen
from rig.page.guard import Guard
from rig.page.packet import Packet
from rig.snapshot import Snapshot

HOST = "127.0.0.1"
STATIC = Path(__file__).parent / "static"
SECONDS_TO_CLOSE = 1
SECONDS_BETWEEN_LOOKS = 0.004
GOING_AWAY = 1001  # websocket close code


class Publisher:
    """Where the live loop leaves its newest snapshot.

    Attributes
    ----------
    port : int
        The port that the page is on.
    watchers : int
        Pages that are open now; a loop may leave out what only they would see.
    """

    def __init__(self, port: int, screen: Screen | None):
        self.port = port
        self.watchers = 0
        self._screen = screen
        self._newest: Packet | None = None
        self._closed = False

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{HOST}:{self.port}/"

    def publish(self, snapshot: Snapshot) -> None:
        """Make this the newest snapshot; takes microseconds, whoever watches."""
        self._newest = Packet(snapshot, self._screen)

    async def newer(self, seen: Packet | None) -> Packet | None:
        """Wait for a packet other than `seen`; None when the server closes.

        It looks again and again because waking this thread from `publish` would hand it the
        interpreter at once: measured 1 ms in the median and 4 ms at p95, taken from the loop.
        """
        while not self._closed and (self._newest is None or self._newest is seen):
            await asyncio.sleep(SECONDS_BETWEEN_LOOKS)
        return None if self._closed else self._newest

    def close(self) -> None:
        """Let every waiting page go."""
        self._closed = True


@contextmanager
def serve(port: int = 8765, screen: Screen | None = None) -> Iterator[Publisher]:
    """Serve the operator page while the block runs; yields the `Publisher` that feeds it.

    Parameters
    ----------
    port : int
        Port on 127.0.0.1; 0 takes a free one, which `Publisher.port` then names.
    screen : Screen or None
        The projector's picture for the page's projector view; None if there is no projector.

    Raises
    ------
    ValueError
        If the port is outside 0..65535.
    OSError
        If the port cannot be had; raised before anything is started.
    """
    with _listen(port) as listener:
        publisher = Publisher(listener.getsockname()[1], screen)
        server = uvicorn.Server(_configuration(publisher))
        thread = threading.Thread(target=server.run, args=([listener],), name="page")
        thread.start()
        try:
            yield publisher
        finally:
            publisher.close()
            server.should_exit = True
            thread.join()


def _listen(port: int) -> socket.socket:
    """Take the port, or say in one sentence why it cannot be had."""
    if not 0 <= port <= 65535:
        raise ValueError(
            f"page port must lie in 0..65535, got {port}; choose another with --set page.port=8765"
        )
    # asyncio sends without delay only where the protocol is named; else small parts wait 40 ms
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    if os.name == "posix":  # there it only skips the wait after a close; elsewhere it would share
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
        listener.listen()
    except OSError as error:
        listener.close()
        raise OSError(_refusal(port, error)) from error
    return listener


def _refusal(port: int, error: OSError) -> str:
    other = port + 1 if 1024 <= port < 65535 else 8765
    if error.errno == errno.EADDRINUSE:
        return (
            f"port {port} on {HOST} is in use; "
            f"choose another with --set page.port={other} or stop the other program"
        )
    return (
        f"port {port} on {HOST} cannot be opened ({error.strerror}); "
        f"choose another with --set page.port={other}"
    )


def _configuration(publisher: Publisher) -> uvicorn.Config:
    return uvicorn.Config(
        _application(publisher),
        ws="websockets-sansio",
        ws_per_message_deflate=False,  # pictures do not shrink, and it costs a third of the frames
        ws_max_size=1024,  # a page only ever sends the names of parts
        lifespan="off",
        log_config=None,
        log_level="critical",
        timeout_graceful_shutdown=SECONDS_TO_CLOSE,
    )


def _application(publisher: Publisher) -> Starlette:
    async def stream(websocket: WebSocket) -> None:
        await _stream(websocket, publisher)

    return Starlette(
        routes=[
            WebSocketRoute("/stream", stream),
            Mount("/", StaticFiles(directory=STATIC, html=True)),
        ],
        middleware=[Middleware(Guard)],
    )


async def _stream(websocket: WebSocket, publisher: Publisher) -> None:
    """Answer each list of wanted parts with the newest packet that this page has not seen."""
    await websocket.accept()
    publisher.watchers += 1
    packet = None
    try:
        async for wanted in websocket.iter_text():
            packet = await publisher.newer(packet)
            if packet is None:
                await websocket.close(GOING_AWAY)
                return
            parts = packet.parts(set(wanted.split()))
            await websocket.send_text(packet.header(parts))
            for part in parts.values():
                await websocket.send_bytes(part)
    except WebSocketDisconnect:
        pass  # the page was closed while its answer was on the way
    finally:
        publisher.watchers -= 1

"""A web application on a port, in a thread beside the live loop that never holds it."""

from __future__ import annotations

import asyncio
import errno
import os
import socket
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from typing import Generic, TypeVar

import uvicorn
from starlette.applications import Starlette

from rig.web.limits import BATCH, LimitedPages, LimitedRequests

HOST = "127.0.0.1"
EVERYWHERE = "0.0.0.0"
QUEUE = 1024  # connections that may wait until they are taken
TURN = 5e-4  # s that a busy server keeps the interpreter from the live loop, each time that it asks
GOING_AWAY = 1001  # websocket close code
SECONDS_TO_CLOSE = 1
SECONDS_BETWEEN_POLLS = 0.004
T = TypeVar("T")


class Newest(Generic[T]):
    """Where the live loop leaves what is newest, for the server's thread to pick up."""

    def __init__(self):
        self._newest: T | None = None
        self._closed = False

    def put(self, item: T) -> None:
        """Make this the newest; takes microseconds, whoever waits."""
        self._newest = item

    async def newer(self, seen: T | None) -> T | None:
        """Wait for another than `seen`; None when all is closed.

        It polls because waking this thread from `put` would hand it the
        interpreter at once: measured 1 ms in the median and 4 ms at p95, taken from the loop.
        """
        while not self._closed and (self._newest is None or self._newest is seen):
            await asyncio.sleep(SECONDS_BETWEEN_POLLS)
        return None if self._closed else self._newest

    def close(self) -> None:
        """Let all who wait go."""
        self._closed = True


def listen(port: int, key: str, host: str = HOST, option: str | None = None) -> socket.socket:
    """Take a port; 0 takes a free one.

    Parameters
    ----------
    port : int
    key : str
        Key of the scene that sets it, for the sentences.
    host : str
        Address that it is taken on; only the loopback address unless said otherwise.
    option : str or None
        What sets it on the command line where no scene does, such as ``--port``.

    Raises
    ------
    ValueError
        If the port is outside 0..65535.
    OSError
        If it cannot be had.
    """
    words = f"--set {key}=" if option is None else f"{option} "
    if not 0 <= port <= 65535:
        raise ValueError(
            f"{key.replace('.', ' ')} must lie in 0..65535, got {port}; choose another with"
            f" {words}8765"
        )
    # asyncio sends without delay only where the protocol is named; else small parts wait 40 ms
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    if os.name == "posix":  # there it only skips the wait after a close; elsewhere it would share
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen()
    except OSError as error:
        listener.close()
        raise OSError(_refusal(port, words, error)) from error
    return listener


class _Server(uvicorn.Server):
    """Takes few connections at a time, and lets many wait for their turn meanwhile."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Open the doors."""
        await super().startup(sockets)
        for one in sockets or ():
            one.listen(QUEUE)


@contextmanager
def serving(
    application: Starlette,
    listener: socket.socket,
    name: str,
    requests: type[LimitedRequests] = LimitedRequests,
) -> Generator[None]:
    """Serve an application in a thread called `name` while the block runs."""
    server = _Server(_configuration(application, requests))
    thread = threading.Thread(target=server.run, args=([listener],), name=name)
    usual = sys.getswitchinterval()
    sys.setswitchinterval(min(usual, TURN))
    thread.start()
    try:
        yield
    finally:
        server.should_exit = True
        thread.join()
        sys.setswitchinterval(usual)


def _refusal(port: int, words: str, error: OSError) -> str:
    other = port + 1 if 1024 <= port < 65535 else 8765
    if error.errno == errno.EADDRINUSE:
        return (
            f"port {port} on {HOST} is in use; "
            f"choose another with {words}{other} or stop the other program"
        )
    return (
        f"port {port} on {HOST} cannot be opened ({error.strerror}); "
        f"choose another with {words}{other}"
    )


def _configuration(application: Starlette, requests: type[LimitedRequests]) -> uvicorn.Config:
    return uvicorn.Config(
        application,
        http=requests,
        ws=LimitedPages,
        backlog=BATCH,
        ws_per_message_deflate=False,  # images do not shrink, and it costs a third of the frames
        ws_max_size=1024,  # nobody sends us more than a few words
        lifespan="off",
        log_config=None,
        log_level="critical",
        timeout_graceful_shutdown=SECONDS_TO_CLOSE,
    )

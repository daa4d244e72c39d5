"""Serve the page on a loopback port from a thread beside the live loop.

A page asks for each frame when it has done with the last, and gets the newest then. So a slow
page sees fewer frames, nothing queues, and the loop only ever leaves its newest snapshot behind.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.routing import Mount, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from rig.markers import Screen
from rig.page.guard import Guard
from rig.page.packet import Packet
from rig.serving import GOING_AWAY, HOST, Newest, listen, serving
from rig.snapshot import Snapshot

STATIC = Path(__file__).parent / "static"


class Publisher:
    """Where the live loop leaves its newest snapshot.

    Attributes
    ----------
    port : int
        The port that the page is on.
    watchers : int
        Pages that are open now; a loop may leave out what only they would see.
    packets : Newest
        What the pages are given.
    """

    def __init__(self, port: int, screen: Screen | None):
        self.port = port
        self.watchers = 0
        self.packets: Newest[Packet] = Newest()
        self._screen = screen

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{HOST}:{self.port}/"

    def publish(self, snapshot: Snapshot) -> None:
        """Make this the newest snapshot; takes microseconds, whoever watches."""
        self.packets.put(Packet(snapshot, self._screen))


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
    with listen(port, "page.port") as listener:
        publisher = Publisher(listener.getsockname()[1], screen)
        with serving(_application(publisher), listener, "page"):
            try:
                yield publisher
            finally:
                publisher.packets.close()


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
            packet = await publisher.packets.newer(packet)
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

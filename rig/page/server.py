"""Serve the page from a thread beside the live loop.

A page asks for each frame when it has done with the last, and gets the newest then. So a slow
page sees fewer frames, nothing queues, and the loop only ever leaves its newest snapshot behind.
What a user asks for waits until the loop takes it.
"""

import json
import socket
from collections import deque
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from rig.live.snapshot import Snapshot
from rig.page.controls import PageControls
from rig.page.packet import NOTHING, Packet, Wire
from rig.projector.content import Content
from rig.projector.markers import Screen
from rig.web.access import Access
from rig.web.guard import CONTROLS, Guard
from rig.web.serving import EVERYWHERE, GOING_AWAY, HOST, Newest, listen, serving

STATIC = Path(__file__).parent / "static"
LONGEST = 512  # bytes of what a page may ask for
LONGEST_NUMBER = 15  # digits that a float holds
WAITING = 32  # things asked for that may wait
Asked = dict[str, Any]


class Publisher:
    """Where the live loop leaves its newest snapshot, and finds what users have asked for.

    Attributes
    ----------
    port : int
        The port that the page is on.
    watchers : int
        Pages that are open now; a loop may leave out what only they would see.
    packets : Newest
        What the pages are given.
    takes : tuple of str or None
        What users may ask for: others are refused. None until whoever takes them has said it.
    """

    def __init__(self, port: int, screen: Screen | None, access: Access):
        self.port = port
        self.watchers = 0
        self.takes: tuple[str, ...] | None = None
        self.packets: Newest[Wire] = Newest()
        self._screen, self._access = screen, access
        self._asked: deque[Asked] = deque(maxlen=WAITING)

    @property
    def url(self) -> str:
        """Address of the page; with the token where this machine has other users."""
        return self.address("")

    def address(self, page: str) -> str:
        """Address of one of the pages by its file, as `url` is that of the live loop's."""
        query = "" if self._access.alone else f"?token={self._access.token}"
        return f"http://{HOST}:{self.port}/{page}{query}"

    @property
    def link(self) -> str | None:
        """Address for others on the network, with the token; None where they are kept out."""
        if not self._access.everywhere:
            return None
        return f"http://{socket.gethostname()}:{self.port}/?token={self._access.token}"

    def publish(
        self,
        snapshot: Snapshot,
        page_controls: PageControls = NOTHING,
        shown: Content | None = None,
    ) -> None:
        """Make this the newest snapshot; takes microseconds, whoever watches."""
        self.packets.put(Packet(snapshot, self._screen, page_controls, shown))

    def ask(self, wish: Asked) -> None:
        """Note what a user asks for; the oldest is forgotten if nobody takes any."""
        self._asked.append(wish)

    def asked(self) -> Iterator[Asked]:
        """Take what users have asked for since, in order."""
        while self._asked:
            yield self._asked.popleft()


@contextmanager
def serve(
    port: int = 8765, screen: Screen | None = None, access: Access | None = None
) -> Generator[Publisher]:
    """Serve the operator page while the block runs; yields the `Publisher` that feeds it.

    Parameters
    ----------
    port : int
        Port on 127.0.0.1; 0 takes a free one, which `Publisher.port` then names.
    screen : Screen or None
        The projector's image for the page's projector view; None if there is no projector.
    access : Access or None
        With a token the port is open to the network as well; None keeps it to this machine.

    Raises
    ------
    ValueError
        If the port is outside 0..65535.
    OSError
        If the port cannot be had; raised before anything is started.
    """
    access = access or Access()
    with listen(port, "page.port", EVERYWHERE if access.everywhere else HOST) as listener:
        publisher = Publisher(listener.getsockname()[1], screen, access)
        with serving(_application(publisher, access), listener, "page"):
            try:
                yield publisher
            finally:
                publisher.packets.close()


def _application(publisher: Publisher, access: Access) -> Starlette:
    async def stream(websocket: WebSocket) -> None:
        await _stream(websocket, publisher)

    async def ask(request: Request) -> Response:
        return await _ask(request, publisher)

    return Starlette(
        routes=[
            WebSocketRoute("/stream", stream),
            Route("/ask", ask, methods=["POST"]),
            Mount("/", StaticFiles(directory=STATIC, html=True)),
        ],
        middleware=[Middleware(Guard, access=access)],
    )


async def _ask(request: Request, publisher: Publisher) -> Response:
    """Take a wish of a user who may act: a JSON object with what to `do`."""
    if not request.scope.get(CONTROLS):
        return PlainTextResponse("this page may look and not act\n", 403)
    body = bytearray()
    async for part in request.stream():
        body += part
        if len(body) > LONGEST:
            return PlainTextResponse(f"a wish has {LONGEST} bytes at most\n", 413)
    wish: Any = None
    with suppress(ValueError):
        wish = json.loads(body, parse_int=_number)
    match wish:
        case {"do": str(what)} if publisher.takes is not None and what not in publisher.takes:
            known = ", ".join(publisher.takes)
            return PlainTextResponse(f"nothing here does {what!r}; ask for one of {known}\n", 400)
        case {"do": str()}:
            publisher.ask(wish)
            return Response(status_code=204)
        case _:
            return PlainTextResponse("a wish is a JSON object with what to do\n", 400)


def _number(digits: str) -> float:
    """Read a whole number; one beyond all others is infinite, since no float holds it."""
    return int(digits) if len(digits) <= LONGEST_NUMBER else float(digits)


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
            parts = packet.parts(wanted)
            await websocket.send_text(packet.header(parts, bool(websocket.scope.get(CONTROLS))))
            for part in parts.values():
                await websocket.send_bytes(part)
    except WebSocketDisconnect:
        pass  # the page was closed while its answer was on the way
    finally:
        publisher.watchers -= 1

"""How many connections a server keeps, and how long each may take: whoever floods it is cut off.

A connection that has asked for nothing costs as much as a page: a file descriptor, of which the
live loop needs some as well. So when all places are taken the one goes that has been silent for
longest, and whoever has just come is heard. A request must be over, and a reader must read, within
`PATIENCE`.
"""

# The protocols of uvicorn are not typed in full.
# pyright: reportUnknownMemberType=false
from __future__ import annotations

import asyncio
import time
from collections.abc import Collection
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

REQUESTS = 256  # connections that have not become a websocket
PAGES = 32  # websockets
BATCH = 32  # connections that are taken at once
SPARE = 4  # of the descriptors that the system lets us have, one in so many goes to requests
AT_ONCE = 32  # one in so many goes when there are too many
PATIENCE = 10.0  # s


class LimitedRequests(H11Protocol):
    """Requests, each with a deadline, on no more connections than `REQUESTS`."""

    accepted = True
    longer = 1  # times the usual patience

    def connection_made(self, transport: Any) -> None:
        """Take a connection, and let the longest silent one go if there are too many."""
        super().connection_made(transport)
        self.heard = time.monotonic()
        self._late = self.loop.call_later(self.longer * PATIENCE, transport.abort)
        _make_room(self.connections, LimitedRequests, request_limit())

    def data_received(self, data: bytes) -> None:
        """Note that the other end speaks; that alone does not put its deadline off."""
        self.heard = time.monotonic()
        super().data_received(data)

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Hand the connection on, without the deadline."""
        self._late.cancel()
        super().handle_websocket_upgrade(event)

    def on_response_complete(self) -> None:
        """Give the next request on this connection its own deadline."""
        self._late.cancel()
        self._late = self.loop.call_later(self.longer * PATIENCE, self.transport.abort)
        super().on_response_complete()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the deadline."""
        self._late.cancel()
        super().connection_lost(exc)


class PatientRequests(LimitedRequests):
    """Requests to a server that computes what it gives: a minute's work is no attack."""

    longer = 60


class LimitedPages(WebSocketsSansIOProtocol):
    """Websockets, no more than `PAGES`; one that does not read is cut off."""

    accepted = False
    _late: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Take a websocket, and let the longest silent one go if there are too many."""
        super().connection_made(transport)
        self.heard = time.monotonic()

    async def send(self, message: Any) -> None:
        """Send a message; one who was let in takes a place, which others do not."""
        await super().send(message)
        if message["type"] == "websocket.accept":
            self.accepted = True
            _make_room(self.connections, LimitedPages, PAGES)

    def data_received(self, data: bytes) -> None:
        """Note that the other end speaks."""
        self.heard = time.monotonic()
        super().data_received(data)

    def pause_writing(self) -> None:
        """Wait for a reader that is behind, but not for ever."""
        super().pause_writing()
        self._late = self.loop.call_later(PATIENCE, self.transport.abort)

    def resume_writing(self) -> None:
        """Go on: the reader has read."""
        self._read()
        super().resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the deadline."""
        self._read()
        super().connection_lost(exc)

    def _read(self) -> None:
        if self._late is not None:
            self._late.cancel()
            self._late = None


def request_limit() -> int:
    """Return how many connections without a websocket are kept at most."""
    try:
        import resource
    except ImportError:  # Windows, which has no such limit
        return REQUESTS
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return REQUESTS if soft < 0 else max(min(REQUESTS, soft // SPARE), BATCH)


def _make_room(connections: Collection[Any], kind: type[Any], count: int) -> None:
    """Cut off those of a kind that have been silent for longest, if there are too many.

    Several at once, so that a flood costs no search for each that comes.
    """
    if len(connections) <= count:
        return
    ours = [
        one
        for one in connections
        if isinstance(one, kind) and one.accepted and not one.transport.is_closing()
    ]
    if len(ours) > count:
        for one in sorted(ours, key=lambda one: one.heard)[: max(count // AT_ONCE, 1)]:
            one.transport.abort()

"""Touches as JSON over a websocket: one text a frame, to whoever listens on this machine.

A text is an object: `sequence`, `captured` (s, on the clock of the frames), `plate` (mm, mm),
`status`, and `touches`, each with `id`, `x`, `y` (mm), `force` (N), `sigma` (semi-axes in mm, angle
in rad), `sigma_force` (N) and `force_interval` (N, N), bounds of 95 % where that is not even, else
null; `gestures`, those of the last second, each with `kind`, `time` (s), `x`, `y` (mm), `value`,
`angle` and `identities`, as `rig.live.gestures.Gesture` says; `alarms`, those that stand, each with
`kind`, `time` (s) and `sentence`; and `taps`, those of a plate that is followed in time that ended
in the last second, each with `x`, `y` (mm), `force` (N, the largest, or null), `at_least` (N),
`time` (s) and `sigma` (mm, mm, N). A client that is slow gets fewer frames, always the newest.
"""

from __future__ import annotations

import json
import math
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from rig.live.snapshot import Mark, Snapshot
from rig.web.guard import Guard
from rig.web.serving import GOING_AWAY, HOST, Newest, listen, serving

if TYPE_CHECKING:
    from models import Tap

PORT = 8766
PATH = "/touches"


class TouchStream:
    """Where the live loop leaves the touches of a frame; use `serve_touches`.

    Attributes
    ----------
    url : str
        Address that clients connect to.
    """

    def __init__(self, port: int):
        self.url = f"ws://{HOST}:{port}{PATH}"
        self.snapshots: Newest[Snapshot] = Newest()

    def __call__(self, snapshot: Snapshot) -> None:
        """Send the touches of a frame; takes microseconds, whoever listens."""
        self.snapshots.put(snapshot)


@contextmanager
def serve_touches(port: int = PORT) -> Generator[TouchStream]:
    """Serve the stream on a loopback port while the block runs; 0 takes a free one.

    Programs know it by its port alone, so everyone on this machine may listen, as to TUIO.

    Raises
    ------
    ValueError
        If the port is outside 0..65535.
    OSError
        If the port cannot be had; raised before anything is started.
    """
    with listen(port, "outputs.websocket.port") as listener:
        stream = TouchStream(listener.getsockname()[1])
        with serving(_application(stream), listener, "touches"):
            try:
                yield stream
            finally:
                stream.snapshots.close()


def text(snapshot: Snapshot) -> str:
    """JSON of a frame."""
    frame = {
        "sequence": snapshot.sequence,
        "captured": snapshot.captured,
        "plate": snapshot.plate_size,
        "status": snapshot.status,
        "touches": [_touch(mark) for mark in snapshot.touches],
        "gestures": [asdict(gesture) for gesture in snapshot.gestures],
        "alarms": [asdict(alarm) for alarm in snapshot.alarms],
        "taps": [_tap(tap) for tap in snapshot.recent_taps],
    }
    return json.dumps(frame, allow_nan=False)


def _touch(mark: Mark) -> dict[str, Any]:
    return {
        "id": mark.identity,
        "x": _finite(mark.x),
        "y": _finite(mark.y),
        "force": _finite(mark.force),
        "sigma": [_finite(value) for value in mark.sigma],
        "sigma_force": _finite(mark.sigma_force),
        "force_interval": mark.force_interval and [_finite(bound) for bound in mark.force_interval],
    }


def _tap(tap: Tap) -> dict[str, Any]:
    numbers = {
        name: _finite(getattr(tap, name)) for name in ("x", "y", "force", "at_least", "time")
    }
    return numbers | {"sigma": [_finite(value) for value in tap.sigma]}


def _finite(value: float) -> float | None:
    """Return a number as JSON knows it; null where it is none."""
    return float(value) if math.isfinite(value) else None


def _application(stream: TouchStream) -> Starlette:
    async def send(websocket: WebSocket) -> None:
        await websocket.accept()
        shown = None
        try:
            while (shown := await stream.snapshots.newer(shown)) is not None:
                await websocket.send_text(text(shown))
            await websocket.close(GOING_AWAY)
        except WebSocketDisconnect:
            pass  # the client went while its text was on the way

    return Starlette(routes=[WebSocketRoute(PATH, send)], middleware=[Middleware(Guard)])

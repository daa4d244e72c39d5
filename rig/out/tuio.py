"""Touches by TUIO 1.1 over UDP, for programs that know fingers on a table.

Each frame is one bundle with all that is there, so that a lost packet costs one frame and nothing
else. Source: M. Kaltenbrunner et al., "TUIO: A Protocol for Table-Top Tangible User Interfaces",
GW 2005, profile 2Dcur.
"""

from __future__ import annotations

import socket
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.live.snapshot import Mark
from rig.out.cursors import Cursor, Cursors
from rig.out.osc import bundle, message
from rig.out.udp import UdpClient

ADDRESS = "/tuio/2Dcur"
PORT = 3333  # where TUIO clients listen
MAX_CURSORS = 20  # cursors in one packet, below the 1500 bytes that networks pass in one piece
LAST = 2**31  # frame numbers are 32 bits with sign


class Tuio:
    """Sends the touches of each frame.

    Parameters
    ----------
    T_surface_plate : (3, 3) float64
        Homography from the plate to the surface of the clients; see `across_plate`.
    host : str
        Address of the client.
    port : int
    source : str
        Name of what the touches come from, for the clients.

    Raises
    ------
    OSError
        If the host is not known.
    ValueError
        If the port is outside 1..65535.
    """

    def __init__(
        self,
        T_surface_plate: NDArray[np.float64],
        host: str = "127.0.0.1",
        port: int = PORT,
        source: str = "touchplate",
    ):
        if not 1 <= port <= 65535:
            raise ValueError(f"TUIO port must lie in 1..65535, got {port}; most listen on {PORT}")
        self._cursors = Cursors(T_surface_plate)
        self._client = UdpClient(host, port, "TUIO")
        self._source = f"{source}@{socket.gethostname()}".encode("ascii", "replace").decode()
        self._frame = 0

    @property
    def lost(self) -> int:
        """Frames that could not be sent."""
        return self._client.lost

    @property
    def status(self) -> str:
        """One sentence for the user."""
        return self._client.status

    def __enter__(self) -> Tuio:
        """Leave the socket open for the block."""
        return self

    def __exit__(self, *error: object) -> None:
        """Lift all fingers and close the socket."""
        self._send(())
        self._client.close()

    def __call__(self, marks: Sequence[Mark], captured: float) -> None:
        """Send the touches of a frame; never waits, and a frame that cannot go is lost.

        Parameters
        ----------
        marks : sequence of Mark
            With more than `MAX_CURSORS`, the hardest pressed are sent.
        captured : float, s
            Capture time of the frame, from which velocities come.
        """
        hardest = sorted(marks, key=lambda mark: -mark.force)[:MAX_CURSORS]
        self._send(self._cursors.update(hardest, captured))

    def _send(self, cursors: Sequence[Cursor]) -> None:
        self._frame = (self._frame + 1) % LAST
        self._client.send(frame_bundle(cursors, self._frame, self._source))


def frame_bundle(cursors: Sequence[Cursor], frame: int, source: str) -> bytes:
    """Encode one frame: who sends, who is there, where each is, and the number of the frame."""
    sets = (
        message(ADDRESS, "set", one.session, one.x, one.y, one.vx, one.vy, one.acceleration)
        for one in cursors
    )
    return bundle(
        (
            message(ADDRESS, "source", source),
            message(ADDRESS, "alive", *(one.session for one in cursors)),
            *sets,
            message(ADDRESS, "fseq", frame),
        )
    )

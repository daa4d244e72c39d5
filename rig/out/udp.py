"""A program on the network that gets packets by UDP; a packet that cannot go is lost."""

from __future__ import annotations

import socket
from typing import Any


class UdpClient:
    """Sends packets to one address and never waits.

    Parameters
    ----------
    host : str
    port : int
    name : str
        Of what the packets are, for the sentences.

    Attributes
    ----------
    lost : int
        Packets that could not be sent.
    reason : str
        Why the last of them could not.

    Raises
    ------
    OSError
        If the host is not known.
    """

    def __init__(self, host: str, port: int, name: str):
        family, self._to = _find(host, port, name)
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._name, self._address = name, f"{host}:{port}"
        self.lost, self.reason = 0, ""

    @property
    def status(self) -> str:
        """One sentence for the user, where each packet is a frame with its touches."""
        if self.lost:
            return f"{self.lost} frames could not be sent by {self._name} ({self.reason})"
        return f"touches go by {self._name} to {self._address}"

    def send(self, packet: bytes) -> None:
        """Send a packet, or count it as lost."""
        try:
            self._socket.sendto(packet, self._to)
        except OSError as error:  # no network, or its buffer is full
            self.lost += 1
            self.reason = error.strerror or str(error)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def _find(host: str, port: int, name: str) -> tuple[socket.AddressFamily, tuple[Any, ...]]:
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    except socket.gaierror:
        raise OSError(
            f"{name} host '{host}' is not known; give an address like 127.0.0.1"
        ) from None
    return family, address

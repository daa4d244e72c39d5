"""The link to the projector's window: images go beside it, so that every message stays small."""

from __future__ import annotations

from ctypes import c_ubyte
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.projector.content import Image


class _InMemory:
    """Stands in a message for the image that lies in the memory of both processes."""


class ImageLink:
    """One end of the link, as a `Connection` for content.

    A message that a pipe does not hold waits until the other process reads it, and a window that
    stands still would hold the loop. An image is larger, and lies in memory that both processes
    have. There is room for one: the next may be sent when the other end has answered.

    Parameters
    ----------
    link : Connection
    memory : array of unsigned char
        Of a multiprocessing context, as large as the projector's image.
    size : (int, int)
        Width and height of that image, px.
    """

    def __init__(self, link: Connection, memory: Any, size: tuple[int, int]):
        self._link, self._memory, self._size = link, memory, size

    def send(self, message: Any) -> None:
        """Send what a pipe holds, or an `Image` of the projector's size."""
        if isinstance(message, Image):
            self._pixels()[:] = message.pixels
            message = _InMemory()
        self._link.send(message)

    def recv(self) -> Any:
        """Wait for a message; raises EOFError where the other end is closed."""
        message = self._link.recv()
        return Image(self._pixels().copy()) if isinstance(message, _InMemory) else message

    def poll(self, timeout: float = 0.0) -> bool:
        """Wait for a message for `timeout` s; whether there is one."""
        return self._link.poll(timeout)

    def close(self) -> None:
        """Close this end."""
        self._link.close()

    def _pixels(self) -> NDArray[np.uint8]:
        width, height = self._size
        return np.frombuffer(self._memory, np.uint8).reshape(height, width, 3)


def image_links(context: SpawnContext, size: tuple[int, int]) -> tuple[ImageLink, ImageLink]:
    """Make both ends of a link for images of `size`, px; the second is for the other process."""
    width, height = size
    memory = context.RawArray(c_ubyte, width * height * 3)
    ours, theirs = context.Pipe()
    return ImageLink(ours, memory, size), ImageLink(theirs, memory, size)

"""Brightness out of what cameras send: grey, YUYV, or JPEG that must be whole."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

FORMATS = ("GREY", "YUYV", "MJPG")
"""From exact to compressed: grey and YUYV hold the brightness of each pixel as it was measured."""
BYTES = {"GREY": 1, "YUYV": 2}
"""Bytes a pixel; brightness is the first."""
END_OF_JPEG = b"\xff\xd9"


def brightness(
    raw: NDArray[np.uint8], code: str, size: tuple[int, int], line: int | None = None
) -> NDArray[np.uint8] | None:
    """Take the brightness of each pixel, as a copy.

    Parameters
    ----------
    raw : array of uint8
        The bytes of an image, in any shape.
    code : {"GREY", "YUYV", "MJPG"}
    size : (int, int), px
        Width and height.
    line : int or None, bytes
        Length of a line in `raw` where the driver pads it.

    Returns
    -------
    (H, W) uint8, or None if a part is missing
    """
    if code == "MJPG":
        return _decode(raw)
    (width, height), deep = size, BYTES[code]
    line = line or width * deep
    if raw.size < height * line:
        return None
    rows = raw.reshape(-1)[: height * line].reshape(height, line)
    return rows[:, : width * deep : deep].copy()


def name_of(number: int) -> str:
    """Four letters of a format's number."""
    return number.to_bytes(4, "little").decode("ascii", "replace").rstrip("\0 ")


def _decode(raw: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
    """Decode a JPEG that has its end; OpenCV fills what is missing with grey and says nothing."""
    if not raw.tobytes().rstrip(b"\0").endswith(END_OF_JPEG):  # some cameras pad with zeros
        return None
    image = cv2.imdecode(raw.reshape(-1), cv2.IMREAD_GRAYSCALE)
    return None if image is None else np.asarray(image, np.uint8)

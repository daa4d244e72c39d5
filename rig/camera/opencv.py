"""A camera through OpenCV, which reads what any UVC camera sends: grey, YUYV or JPEG.

OpenCV hides the frame numbers of the driver, so what the driver loses is not counted; where that
matters take `rig.camera.v4l2`. What is here is for Linux; elsewhere see `rig.camera.numbered`.
"""

from __future__ import annotations

import errno
import os
import struct
import sys
import time
from pathlib import Path

import cv2
import numpy as np

from rig.camera.controls import Controls, ControlSetting, Knob, hold
from rig.camera.device import OpenDevice, stamp
from rig.camera.numbered import open_numbered
from rig.camera.panel import Panel
from rig.camera.pixels import FORMATS, brightness, name_of
from rig.camera.quiet import quiet
from rig.camera.reasons import refusal, unsupported
from rig.system.frame import Frame

PATIENCE = ("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "1")
"""Seconds that OpenCV waits for a frame, else 10; it looks there before its first frame."""
MANUAL_EXPOSURE = 1  # V4L2_EXPOSURE_MANUAL
UVC_EXPOSURE = 1e-4  # s a step
QUERY_CAPABILITIES, REQUEST_BUFFERS = 0x80685600, 0xC0145608  # VIDIOC_QUERYCAP, VIDIOC_REQBUFS
NO_BUFFERS = struct.pack("<IIIII", 0, 1, 1, 0, 0)  # none, of mapped memory, for capture
VALUES = {
    Knob.EXPOSURE: cv2.CAP_PROP_EXPOSURE,
    Knob.GAIN: cv2.CAP_PROP_GAIN,
    Knob.FOCUS: cv2.CAP_PROP_FOCUS,
    Knob.WHITE_BALANCE: cv2.CAP_PROP_WB_TEMPERATURE,
}
AUTOMATICS = {
    Knob.EXPOSURE: (cv2.CAP_PROP_AUTO_EXPOSURE, MANUAL_EXPOSURE),
    Knob.FOCUS: (cv2.CAP_PROP_AUTOFOCUS, 0),
    Knob.WHITE_BALANCE: (cv2.CAP_PROP_AUTO_WB, 0),
}
"""Property that sets each knob by itself, and its value when it does not."""
STEPS = {Knob.EXPOSURE: UVC_EXPOSURE}


class OpenCvCamera:
    """A `Device` on an open capture; use `open_camera`."""

    def __init__(
        self,
        name: str,
        capture: cv2.VideoCapture,
        layout: tuple[str, tuple[int, int]],
        settings: tuple[ControlSetting, ...],
    ):
        self.name, self.settings = name, settings
        self._capture = capture
        self._code, self._size = layout
        self._count = 0

    def read(self, timeout: float) -> Frame | None:
        """See `Device.read`; the driver decides how long it waits."""
        there, raw = self._capture.read()
        now = time.monotonic()
        if not there:
            if not Path(self.name).exists():
                raise refusal(self.name, OSError(errno.ENODEV, "gone"))
            return None
        captured = stamp(self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1e3, now)
        self._count += 1
        image = brightness(np.asarray(raw, np.uint8), self._code, self._size)
        return None if image is None else Frame(self._count - 1, captured, image)

    def close(self) -> None:
        """See `Device.close`."""
        with quiet():
            self._capture.release()


def open_camera(name: str, size: tuple[int, int], rate: float, controls: Controls) -> OpenDevice:
    """Open a camera and hold its controls.

    Parameters
    ----------
    name : str
        Device node such as ``/dev/video0``; its number where the system has no such nodes.
    size : (int, int), px
        Width and height.
    rate : float, frames a second
    controls : Controls

    Raises
    ------
    OSError
        If there is no such camera, it is in use, may not be used or has no such images.
    """
    if sys.platform != "linux":
        return open_numbered(name, size, rate, controls)
    _probe(name)
    os.environ.setdefault(*PATIENCE)
    with quiet():
        capture = cv2.VideoCapture(name, cv2.CAP_V4L2)
        if not capture.isOpened():
            raise refusal(name, OSError(errno.EIO, "OpenCV gives no reason"))
        code = _choose(capture, name, size)
        capture.set(cv2.CAP_PROP_FPS, rate)
        capture.set(cv2.CAP_PROP_CONVERT_RGB, 0)
        settings = hold(_panel(capture), controls)
    return OpenCvCamera(name, capture, (code, size), settings)


def _panel(capture: cv2.VideoCapture) -> Panel[int]:
    def get(control: int) -> float | None:
        value = capture.get(control)
        return None if value < 0 else value

    def put(control: int, value: float) -> bool:
        return capture.set(control, round(value))

    return Panel(VALUES, AUTOMATICS, STEPS, get, put)


def _probe(name: str) -> None:
    """Ask the system itself, because OpenCV does not say why it does not open a camera."""
    import fcntl  # which Windows does not have

    try:
        with Path(name).open("rb+", buffering=0) as node:
            fcntl.ioctl(node, QUERY_CAPABILITIES, bytearray(104))
            fcntl.ioctl(node, REQUEST_BUFFERS, bytearray(NO_BUFFERS))
    except OSError as error:
        raise refusal(name, error) from None


def _choose(capture: cv2.VideoCapture, name: str, size: tuple[int, int]) -> str:
    """Set the first format that the camera has in this size."""
    offered: set[str] = set()
    for code in FORMATS:
        capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*code))
        capture.set(cv2.CAP_PROP_FRAME_WIDTH, size[0])
        capture.set(cv2.CAP_PROP_FRAME_HEIGHT, size[1])
        got = _format(capture)
        if got == (code, *size):
            return code
        offered.add("{} {} × {} px".format(*got))
    capture.release()
    wanted = f"{size[0]} × {size[1]} px in {', '.join(FORMATS)}"
    raise unsupported(name, wanted, " and ".join(sorted(offered)))


def _format(capture: cv2.VideoCapture) -> tuple[str, int, int]:
    code = name_of(int(capture.get(cv2.CAP_PROP_FOURCC)))
    width, height = (
        int(capture.get(side)) for side in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)
    )
    return code, width, height

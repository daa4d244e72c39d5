"""A camera through V4L2 itself: frame numbers, damaged images and time stamps of the driver.

The extra package linuxpy (`pip install touchplate[v4l2]`) knows the kernel's structures; the
waiting is our own, so that a camera which has stopped is noticed within the time that was asked.
"""

from __future__ import annotations

import errno
import mmap
import os
import select
import time
from importlib import import_module
from typing import Any

import numpy as np

from rig.camera.controls import Controls, ControlSetting, Knob, hold
from rig.camera.device import stamp
from rig.camera.panel import Panel
from rig.camera.pixels import FORMATS, brightness, name_of
from rig.camera.reasons import refusal, unsupported
from rig.system.frame import Frame
from rig.system.optional import need

BUFFERS = 4
PAUSE = 0.002  # s before a driver that was ready and gave nothing is asked again
USER, CAMERA = 0x00980900, 0x009A0900  # V4L2_CID_BASE, V4L2_CID_CAMERA_CLASS_BASE
VALUES = {
    Knob.EXPOSURE: CAMERA + 2,
    Knob.GAIN: USER + 19,
    Knob.FOCUS: CAMERA + 10,
    Knob.WHITE_BALANCE: USER + 26,
}
AUTOMATICS = {
    Knob.EXPOSURE: (CAMERA + 1, 1),
    Knob.FOCUS: (CAMERA + 12, 0),
    Knob.WHITE_BALANCE: (USER + 12, 0),
}
"""Control that sets each knob by itself, and its value when it does not."""
STEPS = {Knob.EXPOSURE: 1e-4}  # s


class V4l2Camera:
    """A `Device` that takes images from the buffers of the driver; use `open_camera`."""

    def __init__(self, video: Any, name: str, handle: int, settings: tuple[ControlSetting, ...]):
        self.name, self.settings = name, settings
        self._video, self._handle = video, handle
        self._kind, self._memory = video.BufferType.VIDEO_CAPTURE, video.Memory.MMAP
        layout = video.get_raw_format(handle, self._kind).fmt.pix
        self._code = name_of(layout.pixelformat)
        self._size, self._line = (layout.width, layout.height), layout.bytesperline
        self._buffers: list[mmap.mmap] = video.create_mmap_buffers(
            handle, self._kind, self._memory, BUFFERS
        )
        video.enqueue_buffers(handle, self._kind, self._memory, BUFFERS)
        video.stream_on(handle, self._kind)

    def read(self, timeout: float) -> Frame | None:
        """See `Device.read`; a damaged image is left out, and its number with it."""
        end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0:
            try:
                if not select.select([self._handle], [], [], left)[0]:
                    return None
                buffer = self._video.dequeue_buffer(self._handle, self._kind, self._memory)
            except BlockingIOError:  # ready, but not with an image
                time.sleep(PAUSE)
                continue
            except OSError as error:
                raise refusal(self.name, error) from None
            frame = self._frame(buffer)
            if frame:
                return frame
        return None

    def close(self) -> None:
        """See `Device.close`."""
        for buffer in self._buffers:
            buffer.close()
        os.close(self._handle)  # ends the stream as well

    def _frame(self, buffer: Any) -> Frame | None:
        """Copy an image out of its buffer, and give the buffer back; None if it is damaged."""
        image = None
        if not buffer.flags & self._video.BufferFlag.ERROR:
            raw = np.frombuffer(self._buffers[int(buffer.index)], np.uint8, int(buffer.bytesused))
            image = brightness(raw, self._code, self._size, self._line)
            del raw  # the buffer cannot be closed while an array looks at it
        taken = buffer.timestamp.secs + buffer.timestamp.usecs * 1e-6
        number = buffer.sequence
        self._video.enqueue_buffer_raw(self._handle, buffer)  # overwrites what it said
        if image is None:
            return None
        return Frame(number, stamp(taken, time.monotonic()), image)


def open_camera(name: str, size: tuple[int, int], rate: float, controls: Controls) -> V4l2Camera:
    """Open a camera and hold its controls; parameters and errors as in `rig.camera.opencv`.

    Raises
    ------
    OSError
        Also where linuxpy is not installed.
    """
    need("linuxpy", "v4l2")
    video = import_module("linuxpy.video.device")
    handle = -1
    try:
        handle = os.open(name, os.O_RDWR | os.O_NONBLOCK)
        _choose(video, name, handle, size)
        _set_rate(video, handle, rate)
        settings = hold(_panel(video, handle), controls)
        return V4l2Camera(video, name, handle, settings)
    except OSError as error:
        if handle >= 0:
            os.close(handle)
        raise (refusal(name, error) if error.errno else error) from None


def _panel(video: Any, handle: int) -> Panel[int]:
    def get(control: int) -> int | None:
        try:
            return video.get_control(handle, control)
        except OSError:
            return None

    def put(control: int, value: float) -> bool:
        try:
            video.set_control(handle, control, round(value))
        except OSError:
            return False
        return True

    return Panel(VALUES, AUTOMATICS, STEPS, get, put)


def _choose(video: Any, name: str, handle: int, size: tuple[int, int]) -> None:
    """Set the first of our formats that the camera has in this size."""
    kind = video.BufferType.VIDEO_CAPTURE
    offered: set[str] = set()
    for code in FORMATS:
        video.set_format(handle, kind, *size, code)
        got = video.get_raw_format(handle, kind).fmt.pix
        if (name_of(got.pixelformat), got.width, got.height) == (code, *size):
            return
        offered.add(f"{name_of(got.pixelformat)} {got.width} × {got.height} px")
    wanted = f"{size[0]} × {size[1]} px in {', '.join(FORMATS)}"
    raise unsupported(name, wanted, " and ".join(sorted(offered)))


def _set_rate(video: Any, handle: int, rate: float) -> None:
    try:
        video.set_fps(handle, video.BufferType.VIDEO_CAPTURE, rate)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTTY):  # it knows one rate alone
            raise

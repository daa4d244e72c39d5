"""A camera by its number, where the system has no device nodes: Windows and macOS.

OpenCV converts what comes to colours there, and knows exposure, gain, focus and white balance in
units that differ between systems: they are left alone, and each is said not to be held.
"""

from __future__ import annotations

import sys
import time

import cv2
import numpy as np

from rig.camera.controls import Controls, ControlSetting, Knob
from rig.camera.quiet import quiet
from rig.camera.reasons import unsupported
from rig.system.arrays import Grey
from rig.system.frame import Frame

BACKENDS = {"win32": cv2.CAP_DSHOW, "darwin": cv2.CAP_AVFOUNDATION}
"""What of OpenCV reads cameras, by `sys.platform`; of others it chooses."""
LONGEST = 3  # digits of a number
PAUSE = 0.002  # s before a camera that gave nothing is asked again


class NumberedCamera:
    """A `Device` on an open capture; use `open_numbered`."""

    def __init__(self, name: str, capture: cv2.VideoCapture, settings: tuple[ControlSetting, ...]):
        self.name, self.settings = name, settings
        self._capture = capture
        self._count = 0

    def read(self, timeout: float) -> Frame | None:
        """See `Device.read`; OpenCV decides how long it waits, and gives no time of its own."""
        there, raw = self._capture.read()
        now = time.monotonic()
        if not there:
            time.sleep(PAUSE)
            return None
        self._count += 1
        return Frame(self._count - 1, now, _grey(np.asarray(raw, np.uint8)))

    def close(self) -> None:
        """See `Device.close`."""
        with quiet():
            self._capture.release()


def open_numbered(
    device: str, size: tuple[int, int], rate: float, controls: Controls
) -> NumberedCamera:
    """Open a camera; parameters as in `rig.camera.opencv`, but for the device.

    Parameters
    ----------
    device : str
        Number of the camera, from ``0``.

    Raises
    ------
    OSError
        If that is no such number, or there is no such camera or it does not have such images.
    """
    if not device.isdecimal() or len(device) > LONGEST:
        raise OSError(
            f"no camera at {device}, because this system numbers its cameras; name it by its"
            ' number, such as source.device = "0"'
        )
    name = f"camera {device}"
    with quiet():
        capture = cv2.VideoCapture(int(device), BACKENDS.get(sys.platform, cv2.CAP_ANY))
        if not capture.isOpened():
            raise OSError(
                f"{name} does not open; plug it in, close other programs that use it, and let"
                " programs use cameras in the settings of the system"
            )
        _set(capture, name, size)
        capture.set(cv2.CAP_PROP_FPS, rate)
    settings = (ControlSetting(knob, controls.of(knob), None, manual=False) for knob in Knob)
    return NumberedCamera(name, capture, tuple(settings))


def _set(capture: cv2.VideoCapture, name: str, size: tuple[int, int]) -> None:
    sides = cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT
    for side, length in zip(sides, size, strict=True):
        capture.set(side, length)
    got = tuple(int(capture.get(side)) for side in sides)
    if got != size:
        capture.release()
        raise unsupported(name, f"{size[0]} × {size[1]} px", f"{got[0]} × {got[1]} px")


def _grey(image: Grey) -> Grey:
    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)

"""A camera that always drains its device: images wait for a moment, what is lost is counted."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from rig.system.frame import Frame, take_next

if TYPE_CHECKING:
    from rig.camera.controls import ControlSetting
    from rig.camera.device import OpenDevice

SLICE = 0.1  # s that one wait for an image takes: so soon does the thread see that it shall end
SILENCE = 1.0  # s without an image after which the device is opened anew
RETRY = 0.25  # s between attempts to open a device that has gone
WAITING = 8  # images that wait at most
END = 2.0  # s that the thread gets to end; a driver that hangs is left behind


class LiveCamera:
    """A `rig.system.frame.Source` on a device, with a thread that reads every image at once.

    A driver queues images that nobody takes: after a pause of 0.5 s the next two would be half a
    second old. Where the device goes (unplugged, frozen) it is opened again until it comes back.
    Numbers go on over such a gap.

    Parameters
    ----------
    open_device : callable
        Opens the device and holds its controls; called again after an outage.
    clock : callable
        Monotonic time, s; the same that stamps the frames.
    rescue : callable or None
        Called before the device is opened for the second time without an image in between:
        `rig.usb.watch.reset` with the device that has the node.

    Attributes
    ----------
    status : str
        One sentence for the user.
    settings : tuple of ControlSetting
        What became of the controls when the device was last opened.
    dropped : int
        Images that the device numbered and `grab` never gave.
    refused : int
        Images of another size than the first, which nobody gets.
    outages : int
        Times that the device has gone or fallen silent.

    Raises
    ------
    OSError
        If the device cannot be opened.
    """

    def __init__(
        self,
        open_device: Callable[[], OpenDevice],
        clock: Callable[[], float] = time.monotonic,
        rescue: Callable[[], object] | None = None,
    ):
        self._open, self._clock, self._rescue = open_device, clock, rescue
        self.dropped = self.refused = self.outages = 0
        self._waiting: deque[Frame] = deque(maxlen=WAITING)
        self._last = -1  # number of the newest frame
        self._given = -1
        self._silences = 0  # in a row
        self._offset: int | None = None
        self._shape: tuple[int, ...] | None = None
        self._news = threading.Condition()
        self._ending = threading.Event()
        self._ended = False
        self._device: OpenDevice | None = open_device()
        self.settings: tuple[ControlSetting, ...] = self._device.settings
        self.status = self._sound = f"{self._device.name} is open"
        self._thread = threading.Thread(target=self._drain, name="camera", daemon=True)
        self._thread.start()

    def __enter__(self) -> LiveCamera:
        """Leave the camera open for the block."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the camera."""
        self.close()

    def grab(self, timeout: float) -> Frame | None:
        """See `Source.grab`."""
        with self._news:
            self._news.wait_for(lambda: self._has_news() or self._ended, timeout)
            if not self._has_news():
                if self._ended:
                    raise EOFError(self.status)
                return None
            frame = take_next(self._waiting, self._clock())
            self.dropped += frame.sequence - self._given - 1
            self._given = frame.sequence
            return frame

    def close(self) -> None:
        """End the thread and let the device go."""
        self._ending.set()
        self._thread.join(END)

    def _has_news(self) -> bool:
        return bool(self._waiting)

    def _drain(self) -> None:
        """Body of the thread."""
        heard = self._clock()
        while not self._ending.is_set():
            try:
                if self._device is None:
                    self._reopen()
                    heard = self._clock()
                if frame := self._device.read(SLICE) if self._device else None:
                    heard = self._clock()
                    self._take(frame)
                elif self._device and self._clock() - heard > SILENCE:
                    self._silences += 1
                    raise OSError(f"{self._device.name} gives no images; it is opened anew")
            except EOFError as error:
                self._end(str(error))
            except OSError as error:
                self._lose(str(error))
        self._release()

    def _take(self, frame: Frame) -> None:
        """Let an image wait for the loop."""
        self._silences = 0
        image = frame.image
        self._shape = self._shape or image.shape
        if image.shape != self._shape:
            self.refused += 1
            (rows, columns), (high, wide) = image.shape, self._shape
            self.status = (
                f"an image of {columns} × {rows} px came instead of {wide} × {high} px; it is"
                " left out"
            )
            return
        self.status = self._sound
        with self._news:
            if self._offset is None:  # a device that was opened anew counts anew
                self._offset = self._last + 1 - frame.sequence
            number = frame.sequence + self._offset
            if number > self._last:
                self._last = number
                self._waiting.append(replace(frame, sequence=number))
                self._news.notify_all()

    def _reopen(self) -> None:
        """Try to open the device; wait a little where that fails."""
        try:
            if self._silences > 1 and self._rescue:
                self._rescue()
            self._device = self._open()
        except OSError as error:
            self.status = str(error)
            self._ending.wait(RETRY)
            return
        self._offset = None
        self.settings = self._device.settings
        self.status = self._sound = f"{self._device.name} is open again"

    def _lose(self, why: str) -> None:
        self.outages += 1
        self.status = why
        self._release()

    def _end(self, why: str) -> None:
        with self._news:
            self.status, self._ended = why, True
            self._news.notify_all()
        self._ending.set()

    def _release(self) -> None:
        if self._device is not None:
            self._device.close()
            self._device = None

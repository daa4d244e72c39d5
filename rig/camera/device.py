"""What a camera must be able to do before the rest of the bench can use it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from rig.camera.controls import ControlSetting
    from rig.system.frame import Frame

STALEST = 2.0  # s; an older time stamp is of another clock


class OpenDevice(Protocol):
    """An open camera, folder or video, which gives its images one after the other.

    Attributes
    ----------
    name : str
        What the user knows it by: a path, a serial number.
    settings : tuple of ControlSetting
        What became of the controls that it was asked to hold.
    """

    name: str
    settings: tuple[ControlSetting, ...]

    def read(self, timeout: float) -> Frame | None:
        """Next image, with the number that the device gave it; None if none came in `timeout` s.

        Raises
        ------
        OSError
            If the device has gone; its text is a sentence for the user.
        EOFError
            If there are no more images, because the source has an end.
        """
        ...

    def close(self) -> None:
        """Let the device go; it may be gone already."""
        ...


class InOrder:
    """A `rig.system.frame.Source` that leaves nothing out: each grab gives the next image."""

    stored = True

    def __init__(self, device: OpenDevice):
        self._device = device
        self.status = f"{device.name} gives no images"

    def grab(self, timeout: float) -> Frame | None:
        """See `Source.grab`."""
        return self._device.read(timeout)


def stamp(device_time: float, now: float) -> float:
    """Capture time: that of the device where it is on our clock, else the time of arrival.

    Parameters
    ----------
    device_time, now : float, s
        On what may be, and on what is, the monotonic clock.
    """
    return device_time if now - STALEST < device_time <= now else now

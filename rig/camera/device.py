"""What a camera must be able to do before the rest of the bench can use it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from rig.camera.controls import Setting
    from rig.system.frame import Frame

STALEST = 2.0  # s; an older time stamp is of another clock


class Device(Protocol):
    """An open camera, folder or video, which gives its pictures one after the other.

    Attributes
    ----------
    name : str
        What the user knows it by: a path, a serial number.
    settings : tuple of Setting
        What became of the controls that it was asked to hold.
    """

    name: str
    settings: tuple[Setting, ...]

    def read(self, timeout: float) -> Frame | None:
        """Next picture, with the number that the device gave it; None if none came in `timeout` s.

        Raises
        ------
        OSError
            If the device has gone; its text is a sentence for the user.
        EOFError
            If there are no more pictures, because the source has an end.
        """
        ...

    def close(self) -> None:
        """Let the device go; it may be gone already."""
        ...


class InOrder:
    """A `rig.system.frame.Source` that leaves nothing out: each grab gives the next picture."""

    def __init__(self, device: Device):
        self._device = device
        self.status = f"{device.name} gives no pictures"

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

"""Plugging in and out, seen by looking again: libusb tells pyusb nothing by itself."""

# pyusb has no stubs, and types of its own for little of what it gives.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

import usb.util
from usb.backend import IBackend

from rig.usb.devices import UsbDevice, find_device, list_devices
from rig.usb.faults import faults

ListDevices = Callable[[], tuple[UsbDevice, ...]]
PAUSE = 0.1  # s between looks; one takes about a millisecond


@dataclass(frozen=True)
class DeviceChange:
    """A device that came or went."""

    kind: Literal["plugged", "unplugged"]
    device: UsbDevice

    @property
    def sentence(self) -> str:
        """What happened, for the user."""
        return f"{self.device.label} was {'plugged in' if self.kind == 'plugged' else 'unplugged'}"


class Watch:
    """Remembers what was there at the last look.

    Parameters
    ----------
    list_now : callable
        Lists the devices; the first look is taken at once.
    """

    def __init__(self, list_now: ListDevices = list_devices):
        self._list_now = list_now
        self._present = self._now()

    def changes(self) -> tuple[DeviceChange, ...]:
        """Look again; what went comes before what came.

        A device that was out and in again between two looks has a new address and shows as both.
        """
        before, now = self._present, self._now()
        self._present = now
        return (
            *(DeviceChange("unplugged", before[one]) for one in sorted(before.keys() - now)),
            *(DeviceChange("plugged", now[one]) for one in sorted(now.keys() - before)),
        )

    def _now(self) -> dict[tuple[object, ...], UsbDevice]:
        """Devices by what stays the same while one is in; names and nodes come a little later."""
        return {
            (one.bus, one.ports, one.address, one.vendor, one.product): one
            for one in self._list_now()
        }


def wait_for(
    vendor: int,
    product: int,
    timeout: float,
    list_now: ListDevices = list_devices,
    serial: str | None = None,
) -> UsbDevice:
    """Wait until a device is there.

    Parameters
    ----------
    vendor, product : int
    timeout : float, s
    list_now : callable
    serial : str or None
        Of one of several; None takes the first.

    Raises
    ------
    OSError
        If it does not come in time.
    """
    end = time.monotonic() + timeout
    while True:
        for device in list_now():
            if (device.vendor, device.product) == (vendor, product) and (
                serial is None or device.serial == serial
            ):
                return device
        if time.monotonic() > end:
            raise OSError(
                f"no device {vendor:04x}:{product:04x} came within {timeout:g} s; plug it in"
            )
        time.sleep(PAUSE)


def reset(device: UsbDevice, timeout: float = 5.0, backend: IBackend | None = None) -> UsbDevice:
    """Reset a device that hangs, as if it were plugged out and in; gives it as it came back.

    Parameters
    ----------
    device : UsbDevice
    timeout : float, s
        That it gets to come back.
    backend : usb.backend.IBackend or None

    Raises
    ------
    OSError
        If it may not be reset, was unplugged or does not come back.
    """
    found = find_device(device, backend)
    with faults(device.label):
        try:
            found.reset()
        finally:
            usb.util.dispose_resources(found)
    list_now = partial(list_devices, backend)
    return wait_for(device.vendor, device.product, timeout, list_now, device.serial)

"""Controls of a UVC camera by class requests, for one that no driver of the system holds.

While the kernel's driver streams it owns the camera, and controls are set through it
(`rig.camera.opencv`, `rig.camera.v4l2`). Here the driver is detached, which stops the images:
for cameras with a driver of their own, and to set one up before the system sees it. Numbers are
those of the USB Device Class Definition for Video Devices 1.5, tables A-12, A-13 and section 4.2.
"""

# pyusb has no stubs, and types of its own for little of what it gives.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import usb.core
import usb.util
from usb.backend import IBackend

from rig.camera.controls import Knob
from rig.camera.panel import Panel
from rig.usb.devices import VIDEO, Opened, UsbDevice, find_device
from rig.usb.faults import faults

CONTROL_SUBCLASS = 1
CLASS_SPECIFIC = 0x24  # descriptor of an interface's own class
INPUT_TERMINAL, PROCESSING_UNIT = 2, 5
CAMERA_TERMINAL = 0x0201
SET, GET = 0x01, 0x81  # SET_CUR, GET_CUR
OUT, IN = 0x21, 0xA1  # class request to an interface
PATIENCE = 500  # ms
MANUAL_MODE = 1


@dataclass(frozen=True)
class UvcControl:
    """A control: whether the processing unit has it (else the camera), selector and bytes."""

    processing: bool
    selector: int
    size: int


VALUES = {
    Knob.EXPOSURE: UvcControl(False, 0x04, 4),
    Knob.GAIN: UvcControl(True, 0x04, 2),
    Knob.FOCUS: UvcControl(False, 0x06, 2),
    Knob.WHITE_BALANCE: UvcControl(True, 0x0A, 2),
}
AUTOMATICS = {
    Knob.EXPOSURE: (UvcControl(False, 0x02, 1), MANUAL_MODE),
    Knob.FOCUS: (UvcControl(False, 0x08, 1), 0),
    Knob.WHITE_BALANCE: (UvcControl(True, 0x0B, 1), 0),
}
"""Control that sets each knob by itself, and its value when it does not."""
STEPS = {Knob.EXPOSURE: 1e-4}  # s


@contextmanager
def open_uvc(device: UsbDevice, backend: IBackend | None = None) -> Generator[Panel[UvcControl]]:
    """Take a camera from its driver and give its controls; the driver has it back afterwards.

    Raises
    ------
    OSError
        If it is not there, may not be used, is in use or is no UVC camera.
    """
    found = find_device(device, backend)
    with faults(device.label):
        interface = _control_interface(found)
    if interface is None:
        raise OSError(f"{device.label} is no UVC camera; name one that 'touchplate doctor' lists")
    number = interface.bInterfaceNumber
    with faults(device.label):
        detached = _has_driver(found, number)
        if detached:
            found.detach_kernel_driver(number)
        usb.util.claim_interface(found, number)
    try:
        yield _panel(found, number, *_units(bytes(interface.extra_descriptors)))
    finally:
        usb.util.dispose_resources(found)
        if detached:
            _give_back(found, number)


def _panel(device: Opened, interface: int, camera: int, processing: int) -> Panel[UvcControl]:
    def address(control: UvcControl) -> tuple[int, int]:
        unit = processing if control.processing else camera
        return control.selector << 8, unit << 8 | interface  # wValue, wIndex

    def get(control: UvcControl) -> int | None:
        try:
            answer = device.ctrl_transfer(IN, GET, *address(control), control.size, PATIENCE)
        except usb.core.USBError:  # it stalls what it does not have
            return None
        return int.from_bytes(bytes(answer), "little")

    def put(control: UvcControl, value: float) -> bool:
        try:
            data = round(value).to_bytes(control.size, "little")
            device.ctrl_transfer(OUT, SET, *address(control), data, PATIENCE)
        except (usb.core.USBError, OverflowError):  # stalled, or more than it has bytes for
            return False
        return True

    return Panel(VALUES, AUTOMATICS, STEPS, get, put)


def _control_interface(found: Opened) -> Any:
    """Interface that takes the controls of a camera; None if it has none."""
    for configuration in found:
        for interface in configuration:
            kind = (interface.bInterfaceClass, interface.bInterfaceSubClass)
            if kind == (VIDEO, CONTROL_SUBCLASS):
                return interface
    return None


def _units(descriptors: bytes) -> tuple[int, int]:
    """Numbers of camera terminal and processing unit; 0, which nothing has, where absent."""
    camera = processing = start = 0
    while start + 3 < len(descriptors):
        length, kind, subtype, number = descriptors[start : start + 4]
        if kind == CLASS_SPECIFIC and subtype == PROCESSING_UNIT:
            processing = number
        if kind == CLASS_SPECIFIC and subtype == INPUT_TERMINAL:
            terminal = int.from_bytes(descriptors[start + 4 : start + 6], "little")
            camera = number if terminal == CAMERA_TERMINAL else camera
        start += max(1, length)
    return camera, processing


def _has_driver(found: Opened, interface: int) -> bool:
    try:
        return bool(found.is_kernel_driver_active(interface))
    except NotImplementedError:  # systems whose kernel lets nobody ask
        return False


def _give_back(found: Opened, interface: int) -> None:
    try:
        found.attach_kernel_driver(interface)
    except usb.core.USBError:  # unplugged meanwhile: the driver finds it when it comes back
        pass
    finally:
        usb.util.dispose_resources(found)

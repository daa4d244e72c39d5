"""What is plugged in: numbers, names and device nodes, without opening anything."""

# pyusb has no stubs, and types of its own for little of what it gives.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import usb.core
import usb.util
from usb.backend import IBackend

from rig.usb.faults import faults

SYSTEM = Path("/sys/bus/usb/devices")
VIDEO, HUB = 0x0E, 0x09  # USB class codes
Opened = Any
"""A `usb.core.Device`: pyusb gives it its attributes while it runs, so no type knows them."""
NODES = (":*/video4linux/*", ":*/tty/*", ":*/tty*/tty/*")


@dataclass(frozen=True)
class UsbDevice:
    """One device on the bus.

    Attributes
    ----------
    vendor, product : int
        The numbers VID and PID.
    serial, name : str or None
        As the device calls itself; None where it says nothing or we may not ask.
    bus : int
    address : int
        Number on the bus; another one after each plugging in.
    ports : tuple of int
        Way through the hubs; stays the same on the same socket.
    camera : bool
        Whether it is a UVC camera.
    nodes : tuple of str
        Device nodes that the kernel has made for it, such as ``/dev/video0``.
    """

    vendor: int
    product: int
    serial: str | None
    name: str | None
    bus: int
    address: int
    ports: tuple[int, ...]
    camera: bool
    nodes: tuple[str, ...]

    @property
    def code(self) -> str:
        """VID and PID as they are usually written."""
        return f"{self.vendor:04x}:{self.product:04x}"

    @property
    def place(self) -> str:
        """Bus and ports as the kernel writes them: ``1-4.2``."""
        return f"{self.bus}-{'.'.join(map(str, self.ports))}"

    @property
    def label(self) -> str:
        """What a sentence calls it."""
        return f"{self.name or 'device'} {self.code} at {self.place}"


def list_devices(backend: IBackend | None = None, system: Path = SYSTEM) -> tuple[UsbDevice, ...]:
    """List what is plugged in, without the hubs, in the order of the sockets.

    Parameters
    ----------
    backend : usb.backend.IBackend or None
        None takes libusb.
    system : Path
        Where the kernel describes its devices; names and nodes are looked up there.

    Raises
    ------
    OSError
        If libusb is not installed or the bus cannot be read.
    """
    with faults("the USB"):
        found: Any = usb.core.find(find_all=True, backend=backend)
        devices = [_describe(device, system) for device in found if device.bDeviceClass != HUB]
    return tuple(sorted(devices, key=lambda device: (device.bus, device.ports)))


def owner_of(node: str, backend: IBackend | None = None, system: Path = SYSTEM) -> UsbDevice:
    """Find the device that the kernel made a node for.

    Raises
    ------
    OSError
        If no device on the bus has it, or the bus cannot be read.
    """
    for device in list_devices(backend, system):
        if node in device.nodes:
            return device
    raise OSError(f"no USB device has the node {node}; 'touchplate doctor' lists those that have")


def find_device(device: UsbDevice, backend: IBackend | None = None) -> Opened:
    """Find the device of pyusb that sits on the same socket.

    Raises
    ------
    OSError
        If it is there no more.
    """

    def same(other: Opened) -> bool:
        numbers = (other.idVendor, other.idProduct, other.bus, _ports(other))
        return numbers == (device.vendor, device.product, device.bus, device.ports)

    with faults(device.label):
        found = usb.core.find(custom_match=same, backend=backend)
    if found is None:
        raise OSError(f"{device.label} was unplugged; plug it in again")
    return found


def _describe(device: Opened, system: Path) -> UsbDevice:
    ports = _ports(device)
    place = f"{device.bus}-{'.'.join(map(str, ports))}"
    nodes = {f"/dev/{path.name}" for tail in NODES for path in system.glob(place + tail)}
    return UsbDevice(
        vendor=device.idVendor,
        product=device.idProduct,
        serial=_text(system / place / "serial", device, device.iSerialNumber),
        name=_text(system / place / "product", device, device.iProduct),
        bus=device.bus or 0,
        address=device.address or 0,
        ports=ports,
        camera=VIDEO in set(_classes(device)),
        nodes=tuple(sorted(nodes)),
    )


def _ports(device: Opened) -> tuple[int, ...]:
    return tuple(device.port_numbers or (0,))  # root hubs have none


def _text(file: Path, device: Opened, index: int) -> str | None:
    """Text that the kernel has read already, else asked from the device; None if it is silent."""
    try:
        return file.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        pass
    try:
        return cast("str", usb.util.get_string(device, index)) if index else None
    except (usb.core.USBError, ValueError):  # no permission shows as "no langid", a ValueError
        return None
    finally:
        usb.util.dispose_resources(device)


def _classes(device: Opened) -> Iterator[int]:
    """Class codes of the interfaces; none where the descriptors cannot be read."""
    try:
        for configuration in device:
            for interface in configuration:
                yield interface.bInterfaceClass
    except usb.core.USBError:
        return

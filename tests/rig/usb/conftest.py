"""A bus of devices that are written in Python, for the real pyusb."""

import array
import errno
from types import SimpleNamespace

import pytest
import usb.backend
import usb.core

from tests.rig.emulation.light import Light

STALL, GONE, DENIED, BUSY = errno.EPIPE, errno.ENODEV, errno.EACCES, errno.EBUSY


def failure(number):
    return usb.core.USBError(errno.errorcode[number], None, number)


class Toy:
    """A device: numbers, texts, interfaces of (class, subclass, extra descriptors), and answers.

    `control(kind, request, value, index, data)` gets the bytes that are sent, or the number that
    is asked for, and returns bytes; None stalls.
    """

    def __init__(
        self, vendor=0x1209, product=1, serial="S1", name="Toy", ports=(4,), interfaces=()
    ):
        self.vendor, self.product, self.ports = vendor, product, ports
        self.texts = {1: name, 2: serial}
        self.interfaces = interfaces or ((0xFF, 0, b""),)
        self.address, self.bus = 5, 1
        self.denied = self.hangs = False
        self.driver = set()
        self.claimed = set()
        self.resets = 0

    def control(self, kind, request, value, index, data):
        return None

    def answer(self, kind, request, value, index, data):
        if (kind, request, value >> 8) == (0x80, 6, 3):  # a text of the device
            if not value & 0xFF:
                return b"\4\3\x09\4"
            text = self.texts[value & 0xFF].encode("utf-16-le")
            return bytes([len(text) + 2, 3]) + text
        return self.control(kind, request, value, index, data)


class Bus(usb.backend.IBackend):
    """What pyusb asks a system for, answered by toys that can be plugged in and out."""

    def __init__(self, *toys):
        self.toys = list(toys)

    def enumerate_devices(self):
        return iter(list(self.toys))

    def get_parent(self, dev):
        return None

    def get_device_descriptor(self, dev):
        return SimpleNamespace(
            bLength=18, bDescriptorType=1, bcdUSB=0x200, bDeviceClass=0, bDeviceSubClass=0,
            bDeviceProtocol=0, bMaxPacketSize0=64, idVendor=dev.vendor, idProduct=dev.product,
            bcdDevice=0x100, iManufacturer=0, iProduct=1, iSerialNumber=2, bNumConfigurations=1,
            address=dev.address, bus=dev.bus, port_number=dev.ports[-1], port_numbers=dev.ports,
            speed=3,
        )  # fmt: skip

    def get_configuration_descriptor(self, dev, config):
        return SimpleNamespace(
            bLength=9, bDescriptorType=2, wTotalLength=9, bNumInterfaces=len(dev.interfaces),
            bConfigurationValue=1, iConfiguration=0, bmAttributes=0x80, bMaxPower=50,
            extra_descriptors=[],
        )  # fmt: skip

    def get_interface_descriptor(self, dev, intf, alt, config):
        if alt:
            raise IndexError(alt)
        code, subclass, extra = dev.interfaces[intf]
        return SimpleNamespace(
            bLength=9, bDescriptorType=4, bInterfaceNumber=intf, bAlternateSetting=0,
            bNumEndpoints=0, bInterfaceClass=code, bInterfaceSubClass=subclass,
            bInterfaceProtocol=0, iInterface=0, extra_descriptors=list(extra),
        )  # fmt: skip

    def open_device(self, dev):
        self.require(dev)
        if dev.denied:
            raise failure(DENIED)
        return dev

    def close_device(self, dev_handle):
        pass

    def get_configuration(self, dev_handle):
        return 1

    def claim_interface(self, dev_handle, intf):
        if intf in dev_handle.driver:
            raise failure(BUSY)
        dev_handle.claimed.add(intf)

    def release_interface(self, dev_handle, intf):
        dev_handle.claimed.discard(intf)

    def is_kernel_driver_active(self, dev_handle, intf):
        return intf in dev_handle.driver

    def detach_kernel_driver(self, dev_handle, intf):
        dev_handle.driver.discard(intf)

    def attach_kernel_driver(self, dev_handle, intf):
        self.require(dev_handle)
        dev_handle.driver.add(intf)

    def reset_device(self, dev_handle):
        self.require(dev_handle)
        dev_handle.resets += 1
        dev_handle.hangs = False
        dev_handle.address += 1

    def ctrl_transfer(self, dev_handle, bmRequestType, bRequest, wValue, wIndex, data, timeout):
        self.require(dev_handle)
        if dev_handle.hangs:
            raise usb.core.USBTimeoutError("timed out", None, errno.ETIMEDOUT)
        sent = bytes(data) if bmRequestType < 0x80 else len(data)
        answer = dev_handle.answer(bmRequestType, bRequest, wValue, wIndex, sent)
        if answer is None:
            raise failure(STALL)
        if bmRequestType < 0x80:
            return len(data)
        answer = answer[: len(data)]
        data[: len(answer)] = array.array("B", answer)
        return len(answer)

    def require(self, toy):
        if toy not in self.toys:
            raise failure(GONE)


class Board(Toy):
    """A toy with the firmware of `tests/rig/emulation/light.py`."""

    def __init__(self, **options):
        super().__init__(name="Light", **options)
        self.firmware = Light()
        self.control = self.firmware.control


class Webcam(Toy):
    """A UVC camera, as its interfaces say; the kernel's driver has it."""

    def __init__(self, **options):
        super().__init__(name="Cam", interfaces=((0x0E, 1, b""), (0x0E, 2, b"")), **options)
        self.driver = {0, 1}


@pytest.fixture
def make_bus():
    return Bus


@pytest.fixture
def toy():
    return Toy


@pytest.fixture
def light():
    return Board()


@pytest.fixture
def webcam():
    return Webcam(ports=(2, 3), serial="E7")

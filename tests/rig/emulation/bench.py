"""What the emulated devices have in common: how they are described, asked and ordered what to do.

Run by Debian's Python, which has the bindings of umockdev; so nothing here is of this project.
"""

import os
import struct
import sys

import gi

gi.require_version("UMockdev", "1.0")
from gi.repository import GLib, UMockdev  # noqa: E402  (only after its version is required)

HUB_CLASS = 9
HUB = "/devices/pci0000:00/0000:00:14.0/usb1"


def usb_tape(place, node, descriptors, attributes):
    """Describe a USB device to umockdev: what the kernel shows of it in /sys and /dev."""
    bus, address = (int(number) for number in node.split("/")[-2:])
    lines = [
        f"P: {place}", f"N: {node}={descriptors}", f"E: DEVNAME=/dev/{node}",
        "E: DEVTYPE=usb_device", "E: DRIVER=usb", "E: MAJOR=189", f"E: MINOR={address - 1}",
        f"E: BUSNUM={bus:03}", f"E: DEVNUM={address:03}", "E: SUBSYSTEM=usb",
        "A: bConfigurationValue=1", f"A: busnum={bus}", f"A: devnum={address}", "A: speed=480",
        *(f"A: {name}={value}" for name, value in attributes.items()),
        f"H: descriptors={descriptors}",
    ]  # fmt: skip
    return "\n".join(lines) + "\n\n"


def descriptors(vendor, product, code, subclass):
    """Device, configuration and interface descriptor, as hexadecimal digits."""
    of_device = code if code == HUB_CLASS else 0  # others leave it to their interfaces
    head = struct.pack("<BBHBBBB", 18, 1, 0x200, of_device, 0, 0, 64)
    device = head + struct.pack("<HHHBBBB", vendor, product, 1, 0, 0, 0, 1)
    interface = bytes([9, 4, 0, 0, 0, code, subclass, 0, 0])
    configuration = struct.pack("<BBHBBBBB", 9, 2, 9 + len(interface), 1, 1, 0, 0x80, 50)
    return (device + configuration + interface).hex().upper()


HUB_TAPE = usb_tape(HUB, "bus/usb/001/001", descriptors(0x1D6B, 2, HUB_CLASS, 0), {"devpath": "0"})


class Request:
    """One ioctl: its structure, and the answer to the client that waits."""

    def __init__(self, client):
        code = client.get_request() & 0xFFFFFFFF
        self.number, self.letter, size = code & 0xFF, chr(code >> 8 & 0xFF), code >> 16 & 0x3FFF
        self.client = client
        self.structure = client.get_arg().resolve(0, size) if size else None

    def words(self, count, start=0):
        return struct.unpack_from(f"<{count}I", bytes(self.structure.retrieve()), start)

    def put(self, start, content):
        self.structure.update(start, list(content))

    def answer(self, error=0):
        self.client.complete(-1 if error else 0, error)


def handler(letter, answer):
    """Make a handler of ioctls of one letter.

    `answer(request)` gives an errno, 0 for success, or None where it answers later by itself.
    """

    def on_ioctl(base, client):
        request = Request(client)
        if request.letter != letter:
            return False
        error = answer(request)
        if error is not None:
            request.answer(error)
        return True

    made = UMockdev.IoctlBase()
    made.connect("handle-ioctl", on_ioctl)
    return made


def send(line):
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def start():
    """Start a bench with an empty bus."""
    testbed = UMockdev.Testbed.new()
    testbed.add_from_string(HUB_TAPE)
    return testbed


def run(testbed, obey):
    """Say where the bench is, and let `obey(word)` answer each word of stdin with a line."""
    loop = GLib.MainLoop()

    def on_words(stdin, condition):
        words = os.read(stdin, 4096).decode().split()
        if not words:
            loop.quit()
        for word in words:
            send(obey(word))
        return bool(words)

    GLib.unix_fd_add_full(0, 0, GLib.IOCondition.IN | GLib.IOCondition.HUP, on_words)
    send(testbed.get_root_dir())
    loop.run()

"""A board on the USB for the real libusb, where there is none: control transfers of usbfs.

    umockdev-wrapper /usr/bin/python3 board.py

It prints the folder that clients must be given as UMOCKDEV_DIR, then answers each word on stdin:
"state" with what the outputs do, as JSON, and "press", "unplug", "plug" and "hang" with "done".
"""

import errno
import json
import struct

from bench import HUB, descriptors, handler, run, start, usb_tape
from light import Light

NODE = "bus/usb/001/003"
SOCKET = HUB + "/1-5"
VENDOR_CLASS = 0xFF
TAPE = usb_tape(
    SOCKET, NODE, descriptors(0x1209, 1, VENDOR_CLASS, 0),
    {"devpath": "5", "product": "Light", "serial": "L1"},
)  # fmt: skip
CONTROL = 2  # kind of an urb


class EmulatedBoard:
    """Answers the ioctls that libusb makes of a control transfer: submit, then reap."""

    def __init__(self, testbed):
        self.testbed = testbed
        self.handler = handler("U", self.answer)
        self.answers = {
            10: self.submit, 11: self.discard, 12: self.reap, 13: self.reap, 15: self.nothing,
            16: self.nothing, 20: self.reset, 26: self.capabilities,
        }  # fmt: skip
        self.kept = []
        self.plug()

    def plug(self):
        self.testbed.add_from_string(TAPE)
        self.testbed.attach_ioctl("/dev/" + NODE, self.handler)
        self.light, self.done, self.stuck = Light(), [], []
        self.gone = self.hangs = False

    def unplug(self):
        self.gone = True
        self.testbed.detach_ioctl("/dev/" + NODE)
        self.testbed.uevent("/sys" + SOCKET, "remove")
        self.testbed.remove_device("/sys" + SOCKET)

    def answer(self, request):
        if self.gone:
            return errno.ENODEV
        return self.answers.get(request.number, lambda request: errno.ENOTTY)(request)

    def nothing(self, request):
        return 0

    def reset(self, request):
        self.light, self.hangs = Light(), False
        return 0

    def capabilities(self, request):
        request.put(0, struct.pack("<I", 0))
        return 0

    def submit(self, request):
        urb = request.structure
        kind, *_ = struct.unpack_from("<B", bytes(urb.retrieve()))
        (length,) = struct.unpack_from("<i", bytes(urb.retrieve()), 24)
        if kind != CONTROL:
            return errno.EINVAL
        buffer = urb.resolve(16, length)
        content = bytes(buffer.retrieve())
        way, number, value, index, size = struct.unpack_from("<BBHHH", content)
        sent = content[8 : 8 + size] if way < 0x80 else size
        if self.hangs:
            self.stuck.append((urb, buffer))
            return 0
        answer = self.light.control(way, number, value, index, sent)
        status = -errno.EPIPE if answer is None else 0
        if answer:
            buffer.update(8, list(answer[:size]))
        used = size if way < 0x80 else len(answer or b"")
        urb.update(4, list(struct.pack("<i", status)))
        urb.update(28, list(struct.pack("<i", used)))
        self.done.append((urb, buffer))
        return 0

    def reap(self, request):
        if not self.done:
            return errno.EAGAIN
        urb, buffer = self.done.pop(0)
        self.kept = [*self.kept[-3:], (urb, buffer)]  # the client still reads them
        request.structure.set_ptr(0, urb)
        return 0

    def discard(self, request):
        """Take back what is stuck; libusb reaps it as cancelled."""
        if not self.stuck:
            return errno.EINVAL
        urb, buffer = self.stuck.pop(0)
        urb.update(4, list(struct.pack("<i", -errno.ENOENT)))
        self.done.append((urb, buffer))
        return 0

    def obey(self, word):
        match word:
            case "unplug":
                self.unplug()
            case "plug":
                self.plug()
            case "hang":
                self.hangs = True
            case "press":
                self.light.presses[0] += 1
            case "state":
                light = self.light
                return json.dumps([light.levels, light.strobes, light.triggers])
        return "done"


def main():
    testbed = start()
    board = EmulatedBoard(testbed)
    run(testbed, board.obey)


main()

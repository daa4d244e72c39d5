"""A camera at /dev/video0 for real V4L2 clients, where there is none.

    umockdev-wrapper /usr/bin/python3 camera.py WIDTH HEIGHT RATE [JPEG]

It prints the folder that clients must be given as UMOCKDEV_DIR, then obeys words on stdin and
answers each with "done". Pixel (x, y) of frame n is (x + 3 y + 7 n) mod 256; a camera that is given
a JPEG file sends nothing else, and after "show:FOLDER" it sends the files *.raw there in turn.
After "clock:SECONDS" its time stamps are so much ahead; after "watch:FILE" it sends what another
program takes there, as soon as it is whole: the first byte says which of the two images that
follow from byte 4096 on, and the doubles from byte 8 on when each of them was exposed. After
"second" there is another camera at /dev/video1, which takes its frames at the same moments.
"""

import errno
import mmap
import os
import struct
import sys
import time
from pathlib import Path

from bench import HUB, GLib, descriptors, handler, run, start, usb_tape

WIDTH, HEIGHT, RATE = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
LOOK = 2  # ms from one look at a watched file to the next
PATIENCE = 200  # ms that a client waits for a frame before it may ask again
BUFFERS = 4
ROOM = -(-2 * WIDTH * HEIGHT // 4096) * 4096
VIDEO_CLASS = 0x0E
FIRST_SOCKET = 4  # of the hub
FORMATS = ((b"GREY", b"8-bit Greyscale", 1), (b"YUYV", b"YUYV 4:2:2", 2))
COMPRESSED = Path(sys.argv[4]).read_bytes() if len(sys.argv) > 4 else b""
if COMPRESSED:
    FORMATS = ((b"MJPG", b"Motion-JPEG", 0),)
INTEGER, SWITCH, MENU = 1, 2, 3
EXPOSURE_BY, EXPOSURE = 0x009A0901, 0x009A0902
WHITE_BY, WHITE = 0x0098090C, 0x0098091A
FOCUS_BY, FOCUS = 0x009A090C, 0x009A090A
GAIN = 0x00980913
OWNERS = {EXPOSURE: (EXPOSURE_BY, 1), WHITE: (WHITE_BY, 0), FOCUS: (FOCUS_BY, 0)}
"""Control that must have this value before the other one may be set."""


def controls():
    """Type, name, low, high, step and value of each."""
    return {
        WHITE_BY: [SWITCH, b"White Balance, Automatic", 0, 1, 1, 1],
        GAIN: [INTEGER, b"Gain", 0, 255, 1, 16],
        WHITE: [INTEGER, b"White Balance Temperature", 2000, 6500, 1, 4600],
        EXPOSURE_BY: [MENU, b"Auto Exposure", 0, 3, 1, 3],
        EXPOSURE: [INTEGER, b"Exposure Time, Absolute", 3, 2047, 1, 250],
        FOCUS: [INTEGER, b"Focus, Absolute", 0, 250, 5, 30],
        FOCUS_BY: [SWITCH, b"Focus, Automatic Continuous", 0, 1, 1, 1],
    }


def places(number):
    """Where a camera stands in /sys: its socket, its interface, and its node."""
    socket = f"{HUB}/1-{FIRST_SOCKET + number}"
    interface = f"{socket}/1-{FIRST_SOCKET + number}:1.0"
    return socket, interface, f"{interface}/video4linux/video{number}"


def tape(number):
    """Describe a camera to umockdev."""
    socket, interface, place = places(number)
    known = {"devpath": FIRST_SOCKET + number, "product": "Speckle Cam", "serial": f"E{7 + number}"}
    node = f"bus/usb/001/{2 + number:03}"
    return (
        usb_tape(socket, node, descriptors(0x1209, 2, VIDEO_CLASS, 1), known)
        + f"P: {interface}\nE: DEVTYPE=usb_interface\nE: DRIVER=uvcvideo\nE: SUBSYSTEM=usb\n\n"
        + f"P: {place}\nN: video{number}=00\nE: DEVNAME=/dev/video{number}\nE: MAJOR=81\n"
        f"E: MINOR={number}\nE: SUBSYSTEM=video4linux\nE: ID_V4L_CAPABILITIES=:capture:\n"
        f"A: name=Speckle Cam\\n\nA: index=0\\n\nA: dev=81:{number}\\n\n\n"
    )  # fmt: skip


def text(characters, size):
    return characters.ljust(size, b"\0")


def image(number, bytes_a_pixel):
    if COMPRESSED:
        return COMPRESSED
    row = bytes(range(256)) * (WIDTH // 256 + 2)
    starts = ((3 * y + 7 * number) % 256 for y in range(HEIGHT))
    grey = b"".join(row[start : start + WIDTH] for start in starts)
    if bytes_a_pixel == 1:
        return grey
    pairs = bytearray(b"\x80" * (2 * len(grey)))
    pairs[::2] = grey
    return bytes(pairs)


class EmulatedCamera:
    """State of the camera and its answers, an errno each; None is answered later."""

    def __init__(self, testbed, number):
        self.testbed, self.device = testbed, number
        self.node = f"/dev/video{number}"
        self.handler = handler("V", self.answer)
        self.gone = self.frozen = self.busy = self.torn = False
        self.skip = 0
        self.shown = []
        self.watched = None
        self.taken = 0.0  # s: when the last watched image was exposed
        self.ahead = 0.0  # s, of its clock
        self.plug()
        self.answers = {
            0: self.capabilities, 2: self.one_format, 4: self.get_format, 5: self.set_format,
            8: self.request_buffers, 9: self.query_buffer, 15: self.queue_buffer,
            17: self.dequeue_buffer, 18: self.stream_on, 19: self.stream_off, 21: self.rate,
            22: self.rate, 26: self.one_input, 27: self.get_control, 28: self.set_control,
            36: self.query_control, 38: self.which_input, 39: self.which_input,
            64: self.get_format, 71: self.get_controls, 72: self.set_controls, 74: self.one_size,
            75: self.one_rate, 103: self.query_long_control,
        }  # fmt: skip

    def plug(self):
        self.testbed.add_from_string(tape(self.device))
        self.testbed.attach_ioctl(self.node, self.handler)
        self.memory = os.open(self.testbed.get_root_dir() + self.node, os.O_RDWR)
        os.ftruncate(self.memory, ROOM * BUFFERS)
        self.controls = controls()
        self.format, self.number = FORMATS[0], 0
        self.gone = self.streaming = False
        self.empty, self.full, self.waiting = [], [], None

    def unplug(self):
        self.gone = True
        self.testbed.detach_ioctl(self.node)
        for place in reversed(places(self.device)):
            self.testbed.uevent("/sys" + place, "remove")
            self.testbed.remove_device("/sys" + place)

    def tick(self, now):
        """Time for another frame, unless another program takes them."""
        if not self.watched:
            self.send(now)

    def look(self):
        """Send what a watched file has new."""
        taken = struct.unpack_from("<d", self.watched, 8 + 8 * self.watched[0])[0]
        if taken > self.taken:
            self.taken = taken
            self.send(taken)
        return True

    def send(self, taken):
        """Give a image, exposed at `taken`, to whoever waits for one."""
        if not self.streaming or self.frozen or self.gone:
            return
        self.number += 1
        if self.skip:
            self.skip -= 1
        elif self.empty:
            index = self.empty.pop(0)
            os.pwrite(self.memory, self.image(), index * ROOM)
            self.full.append((index, self.number, taken + self.ahead))
            if self.waiting:
                waiting, self.waiting = self.waiting, None
                waiting.answer(self.dequeue_buffer(waiting))

    def image(self):
        if self.watched:
            start = 4096 + self.watched[0] * WIDTH * HEIGHT
            return self.watched[start : start + WIDTH * HEIGHT]
        if self.shown:
            return self.shown[self.number % len(self.shown)]
        return image(self.number, self.format[2])

    def answer(self, request):
        if self.gone:
            return errno.ENODEV
        return self.answers.get(request.number, lambda request: errno.ENOTTY)(request)

    # what it is and what it has

    def capabilities(self, request):
        can = 0x04200001  # capture, streaming
        bus = b"usb-0000:00:14.0-%d" % (FIRST_SOCKET + self.device)
        names = text(b"uvcvideo", 16) + text(b"Speckle Cam", 32) + text(bus, 32)
        request.put(0, names + struct.pack("<III", 0x060000, can | 0x80000000, can))
        return 0

    def one_format(self, request):
        index, kind = request.words(2)
        if kind != 1 or index >= len(FORMATS):
            return errno.EINVAL
        code, name, _ = FORMATS[index]
        request.put(8, struct.pack("<I", 0) + text(name, 32) + code)
        return 0

    def get_format(self, request):
        if request.words(1) != (1,):
            return errno.EINVAL
        line = WIDTH * self.format[2]
        sizes = struct.pack("<II", WIDTH, HEIGHT) + self.format[0]
        request.put(8, sizes + struct.pack("<IIIII", 1, line, self.length(), 8, 0))
        return 0

    def length(self):
        """Bytes of a image."""
        return len(COMPRESSED) or WIDTH * HEIGHT * self.format[2]

    def set_format(self, request):
        if self.busy:
            return errno.EBUSY
        wanted = struct.pack("<I", request.words(1, 16)[0])
        self.format = next((known for known in FORMATS if known[0] == wanted), self.format)
        return self.get_format(request)

    def one_size(self, request):
        if request.words(1) != (0,):
            return errno.EINVAL
        request.put(8, struct.pack("<III", 1, WIDTH, HEIGHT))
        return 0

    def one_rate(self, request):
        if request.words(1) != (0,):
            return errno.EINVAL
        request.put(16, struct.pack("<III", 1, 1, int(RATE)))
        return 0

    def rate(self, request):
        request.put(0, struct.pack("<IIIIIII", 1, 0x1000, 0, 1, int(RATE), 0, BUFFERS))
        return 0

    def one_input(self, request):
        if request.words(1) != (0,):
            return errno.EINVAL
        request.put(0, struct.pack("<I", 0) + text(b"Camera 1", 32) + struct.pack("<I", 2))
        return 0

    def which_input(self, request):
        request.put(0, struct.pack("<i", 0))
        return 0

    # images

    def request_buffers(self, request):
        count, kind, memory = request.words(3)
        if kind != 1 or memory != 1:
            return errno.EINVAL
        if self.busy:
            return errno.EBUSY
        if not count:
            self.empty, self.full = [], []
        request.put(0, struct.pack("<I", min(count, BUFFERS)))
        return 0

    def buffer(self, request, index, used, flags, number=0, taken=0.0):
        seconds, rest = divmod(taken, 1)
        head = struct.pack("<IIIIIxxxx", index, 1, used, flags, 1)
        when = struct.pack("<qq16x", int(seconds), int(rest * 1e6))
        request.put(0, head + when + struct.pack("<IIIxxxxI", number, 1, index * ROOM, ROOM))
        return 0

    def query_buffer(self, request):
        (index,) = request.words(1)
        return self.buffer(request, index, 0, 0x2000) if index < BUFFERS else errno.EINVAL

    def queue_buffer(self, request):
        (index,) = request.words(1)
        self.empty.append(index)
        return self.buffer(request, index, 0, 0x2003)

    def dequeue_buffer(self, request):
        if not self.full:
            if self.waiting or not self.streaming:
                return errno.EAGAIN if self.waiting else errno.EINVAL
            self.waiting = request
            GLib.timeout_add(PATIENCE, self.give_up, request)
            return None
        index, number, taken = self.full.pop(0)
        used, flags = self.length(), 0x2005
        if self.torn:
            used, flags, self.torn = used // 2, flags | 0x40, False
        return self.buffer(request, index, used, flags, number, taken)

    def give_up(self, request):
        if self.waiting is request:
            self.waiting = None
            request.answer(errno.ENODEV if self.gone else errno.EAGAIN)
        return False

    def stream_on(self, request):
        self.streaming = True
        return 0

    def stream_off(self, request):
        self.streaming, self.empty, self.full = False, [], []
        return 0

    # controls

    def query_control(self, request):
        name = self.named(request.words(1)[0])
        if name is None:
            return errno.EINVAL
        kind, label, low, high, step, value = self.controls[name]
        numbers = struct.pack("<iiiiI", low, high, step, value, 0)
        request.put(0, struct.pack("<II", name, kind) + text(label, 32) + numbers)
        return 0

    def query_long_control(self, request):
        name = self.named(request.words(1)[0])
        if name is None:
            return errno.EINVAL
        kind, label, low, high, step, value = self.controls[name]
        numbers = struct.pack("<qqQqIIII", low, high, step, value, 0, 4, 1, 0)
        request.put(0, struct.pack("<II", name, kind) + text(label, 32) + numbers)
        return 0

    def named(self, asked):
        """Control that is asked for by its number, or as the next one after it."""
        if asked & 0xC0000000:
            return min((name for name in self.controls if name > asked & 0x0FFFFFFF), default=None)
        return asked if asked in self.controls else None

    def get_control(self, request):
        name, _ = request.words(2)
        if name not in self.controls:
            return errno.EINVAL
        request.put(4, struct.pack("<i", self.controls[name][-1]))
        return 0

    def set_control(self, request):
        name, value = request.words(2)
        return self.change(name, value)

    def change(self, name, value):
        if name not in self.controls:
            return errno.EINVAL
        owner, free = OWNERS.get(name, (name, self.controls[name][-1]))
        if self.controls[owner][-1] != free:
            return errno.EACCES  # the automatic that owns it is on
        low, high = self.controls[name][2:4]
        if not low <= value <= high:
            return errno.ERANGE
        self.controls[name][-1] = value
        return 0

    def get_controls(self, request):
        return self.each_control(request, lambda name, value: (0, self.controls[name][-1]))

    def set_controls(self, request):
        return self.each_control(request, lambda name, value: (self.change(name, value), value))

    def each_control(self, request, act):
        count = request.words(2)[1]
        if not count:
            return 0
        entries = request.structure.resolve(24, 20 * count)
        content = bytes(entries.retrieve())
        for index in range(count):
            name, _, _, value = struct.unpack_from("<IIIi", content, 20 * index)
            if name not in self.controls:
                return errno.EINVAL
            error, value = act(name, value)
            if error:
                return error
            entries.update(20 * index + 12, list(struct.pack("<i", value)))
        return 0

    # what goes wrong

    def obey(self, word):
        match word:
            case "unplug":
                self.unplug()
            case "plug":
                self.plug()
            case "freeze" | "thaw":
                self.frozen = word == "freeze"
            case "busy" | "free":
                self.busy = word == "busy"
            case "tear":
                self.torn = True
            case "skip":
                self.skip = 5
            case _ if word.startswith("clock:"):
                self.ahead = float(word.partition(":")[2])
            case _ if word.startswith("show:"):
                files = sorted(Path(word.partition(":")[2]).glob("*.raw"))
                self.shown = [file.read_bytes() for file in files]
            case _ if word.startswith("watch:"):
                with Path(word.partition(":")[2]).open("rb") as file:
                    self.watched = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
                GLib.timeout_add(LOOK, self.look)
        return "done"


def main():
    testbed = start()
    cameras = [EmulatedCamera(testbed, 0)]

    def pulse():
        now = time.monotonic()
        for camera in cameras:
            camera.tick(now)
        return True

    def obey(word):
        if word != "second":
            return cameras[0].obey(word)
        cameras.append(EmulatedCamera(testbed, 1))
        return "done"

    GLib.timeout_add(int(1000 / RATE), pulse)
    run(testbed, obey)


main()

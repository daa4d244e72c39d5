"""The firmware of a board that speaks `rig/usb/board.py`, with three outputs and two switches."""

import struct


class Light:
    """What the board does; `control` gives the answer, or None for a stall."""

    outputs = 3

    def __init__(self):
        self.version = 1
        self.presses = [0, 0]
        self.given, self.missed, self.time = 0, 2, 1_500_000
        self.dark()

    def dark(self):
        self.levels, self.strobes, self.triggers = {}, {}, {}

    def control(self, kind, request, value, index, data):
        """Answer a vendor request; `data` is what was sent, or the length that is asked for."""
        match kind, request:
            case 0xC0, 1:
                return struct.pack("<3sBB3x", b"TPB", self.version, self.outputs)
            case 0xC0, 5:
                return struct.pack("<III", self.given, self.missed, self.time)
            case 0xC0, 7 if index < len(self.presses):
                return struct.pack("<I", self.presses[index])
            case 0x40, 2 if index < self.outputs and value <= 1000:
                self.levels[index] = value
            case 0x40, 3 if len(data) == 8:
                self.strobes[index] = struct.unpack("<II", data)
            case 0x40, 4 if len(data) == 12:
                self.triggers[index] = struct.unpack("<III", data)
            case 0x40, 6:
                self.dark()
            case _:
                return None
        return b""

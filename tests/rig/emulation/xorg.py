"""An X desktop of two outputs without hardware: Xorg with its dummy driver, by xrandr."""

import os
import select
import struct
import subprocess

import numpy as np

NAMES = "DUMMY0", "DUMMY1"
CONFIG = """
Section "Device"
  Identifier "card"
  Driver "dummy"
  VideoRam 128000
EndSection
Section "Monitor"
  Identifier "any"
  HorizSync 5.0-1000.0
  VertRefresh 5.0-200.0
EndSection
Section "Screen"
  Identifier "desktop"
  Device "card"
  Monitor "any"
  DefaultDepth 24
  SubSection "Display"
    Depth 24
    Virtual 2736 800
    Modes "1280x800" "1368x768"
  EndSubSection
EndSection
"""
PATIENCE = 20.0  # s
DUMPS = 5


class XDesktop:
    """Two outputs, each with a size and a place, or put out as one that is unplugged."""

    def __init__(self, folder):
        self._folder = folder

    def start(self):
        config = self._folder / "xorg.conf"
        config.write_text(CONFIG)
        reading, writing = os.pipe()
        self._server = subprocess.Popen(
            ["Xorg", "-displayfd", str(writing), "-config", str(config), "-noreset",
             "-nolisten", "tcp", "-logfile", str(self._folder / "xorg.log")],
            pass_fds=[writing], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(writing)
        with os.fdopen(reading) as said:  # a number and, written for itself, the end of its line
            assert select.select([said], [], [], PATIENCE)[0], "Xorg did not start"
            self.display = f":{said.readline().strip()}"
        self._places = {}
        for name in NAMES:
            for size in ("1280x800", "1368x768"):
                subprocess.run([*self._xrandr, "--addmode", name, size], capture_output=True)

    @property
    def _xrandr(self):
        return "xrandr", "-display", self.display

    def arrange(self, places):
        """Give each output a size and an x, or None where it is unplugged."""
        words = []
        for name, place in zip(NAMES, places, strict=True):
            if place is None:
                words += ["--output", name, "--off"]
            else:
                (width, height), x = place
                words += ["--output", name, "--mode", f"{width}x{height}", "--pos", f"{x}x0"]
        for command in (words, ["--query"]):  # to ask is what has the server look what is there
            subprocess.run([*self._xrandr, *command], check=True, capture_output=True)
        self._places = dict(enumerate(places))

    def pixels(self, index):
        """Return what an output shows, (H, W, 3) RGB; no pixels where it is unplugged."""
        if self._places[index] is None:
            return np.empty((0, 0, 3), np.uint8)
        (width, height), x = self._places[index]
        return self._desktop()[:height, x : x + width]

    def _desktop(self):
        command = ["xwd", "-root", "-silent", "-display", self.display]
        for _ in range(DUMPS):  # the desktop may change its size between its asking and its taking
            done = subprocess.run(command, check=False, capture_output=True)
            if not done.returncode:
                break
        done.check_returncode()
        dump = done.stdout
        header = struct.unpack(">25I", dump[:100])
        wide, high, depth, stride = header[4], header[5], header[11] // 8, header[12]
        start = header[0] + 12 * header[19]
        rows = np.frombuffer(dump, np.uint8, high * stride, start).reshape(high, stride)
        return rows[:, : wide * depth].reshape(high, wide, depth)[..., 2::-1]

    def end(self):
        self._server.terminate()
        self._server.wait()

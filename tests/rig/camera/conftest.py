"""An emulated camera at /dev/video0, and real clients that run against it."""

import json
import os
import subprocess
import sys
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
import pytest

collect_ignore = [] if find_spec("pypylon") and find_spec("genicam") else ["test_machine_vision.py"]

EMULATED = Path(__file__).parent / "emulated_camera.py"
WRAPPER = "/usr/bin/umockdev-wrapper"
SIZE, RATE = (96, 64), 50
SECONDS = 30


class Emulation:
    """The emulated camera: say words to it, and start clients that see it."""

    def __init__(self, process):
        self._process = process
        self.folder = process.stdout.readline().strip()

    def say(self, word):
        self._process.stdin.write(word + "\n")
        self._process.stdin.flush()
        assert self._process.stdout.readline() == "done\n"

    def client(self, script):
        """Start Python on a script; use it as a context."""
        return subprocess.Popen(
            [WRAPPER, sys.executable, "-c", script],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env=os.environ | {"UMOCKDEV_DIR": self.folder},
        )  # fmt: skip

    def answer(self, script):
        """Run a script to its end; gives what it printed as JSON."""
        with self.client(script) as client:
            return json.loads(client.communicate(timeout=SECONDS)[0])


@contextmanager
def emulate(*options):
    command = [WRAPPER, "/usr/bin/python3", EMULATED, *map(str, SIZE), str(RATE), *options]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        yield Emulation(process)
        process.stdin.close()


@pytest.fixture
def emulation():
    with emulate() as camera:
        yield camera


@pytest.fixture
def compressing(tmp_path):
    """Give a camera that sends one JPEG over and over, and the path of that."""
    path = tmp_path / "sent.jpg"
    x, y = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    cv2.imwrite(str(path), (120 + 80 * np.sin(x / 7) * np.cos(y / 5)).astype(np.uint8))
    with emulate(path) as camera:
        yield camera, path


def pytest_configure(config):
    config.addinivalue_line(
        "markers", "devices: needs Debian's umockdev and python3-gi (`make system-deps`)"
    )

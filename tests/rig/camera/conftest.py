"""An emulated camera at /dev/video0, and real clients that run against it."""

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

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


@pytest.fixture
def emulation():
    command = [WRAPPER, "/usr/bin/python3", EMULATED, *map(str, SIZE), str(RATE)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        yield Emulation(process)
        process.stdin.close()


def pytest_configure(config):
    config.addinivalue_line(
        "markers", "devices: needs Debian's umockdev and python3-gi (`make system-deps`)"
    )

"""Real clients against emulated devices: each is a process that umockdev shows another bus."""

import json
import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
WRAPPER = "/usr/bin/umockdev-wrapper"
SYSTEM_PYTHON = "/usr/bin/python3"  # has the bindings of umockdev
SECONDS = 30


class Emulation:
    """An emulated device: say words to it, and start clients that see it."""

    def __init__(self, process: Any) -> None:
        self._process = process
        self.folder: str = process.stdout.readline().strip()

    def ask(self, word: str) -> str:
        """Say a word; gives the line that answers it."""
        self._process.stdin.write(word + "\n")
        self._process.stdin.flush()
        return self._process.stdout.readline().strip()

    def say(self, word: str) -> None:
        assert self.ask(word) == "done"

    def client(self, script, stderr=None):
        """Start Python on a script; use it as a context."""
        return subprocess.Popen(
            [WRAPPER, sys.executable, "-c", script],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=stderr, text=True,
            env=os.environ | {"UMOCKDEV_DIR": self.folder},
        )  # fmt: skip

    def answer(self, script):
        """Run a script to its end; gives what it printed as JSON."""
        with self.client(script) as client:
            return json.loads(client.communicate(timeout=SECONDS)[0])


@contextmanager
def emulate(name, *options):
    """Run the device of a script here while the block lasts."""
    command = [WRAPPER, SYSTEM_PYTHON, HERE / f"{name}.py", *map(str, options)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        yield Emulation(process)
        process.stdin.close()


def nudge(client):
    """Let a client go on that waits for a line; gives what it prints next as JSON."""
    client.stdin.write("\n")
    client.stdin.flush()
    return json.loads(client.stdout.readline())

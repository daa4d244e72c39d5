"""Touches of a played minute, as two receivers that others wrote hear them.

python-tuio and liblo's `oscdump` each listen on a port of their own while four fingers come, move
and go on a plate, 30 frames a second, played as fast as both take them. *Not received* counts
touches of frames (identity and place) that a receiver did not hear, or heard elsewhere.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import select
import socket
import subprocess
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from rig.live.snapshot import Mark
from rig.out import Tuio, across_plate
from rig.report.figure import Figure, at_most
from rig.studies.study import line, part, run

TABLE = "TUIO as others hear it"
CASE = "two independent TUIO clients"
PLATE = (254.0, 203.0)
FRAMES, FINGERS, RATE, SEED = 1800, 4, 30.0, 5
PATIENCE = 10.0  # s
Heard = set[tuple[int | None, int, int]]
"""Identity and place in parts of 10⁵ of each touch of each frame."""


def played() -> list[list[Mark]]:
    """Draw fingers that walk, each there for half of the time and then another one."""
    rng, size = np.random.default_rng(SEED), np.array(PLATE)
    frames, held, identity = list[list[Mark]](), dict[int, tuple[np.ndarray, int]](), 0
    for _ in range(FRAMES):
        for finger in range(FINGERS):
            if rng.random() < 1 / 30:
                if finger in held:
                    del held[finger]
                else:
                    identity += 1
                    held[finger] = rng.uniform(0.1, 0.9, 2) * size, identity
        marks = list[Mark]()
        for finger, (place, name) in held.items():
            walked = np.clip(place + rng.normal(0, 1.0, 2), 0.0, size)
            held[finger] = walked, name
            marks.append(Mark(float(walked[0]), float(walked[1]), 1.0, identity=name))
        frames.append(marks)
    return frames


def said(marks: list[Mark]) -> Heard:
    """Return what a receiver should hear of a frame; TUIO counts y from above."""
    return {
        (mark.identity, round(1e5 * mark.x / PLATE[0]), round(1e5 * (1 - mark.y / PLATE[1])))
        for mark in marks
    }


def python_tuio(frames: list[list[Mark]]) -> tuple[int, int]:
    """Play to python-tuio, packet by packet; touches not received, and all of them."""
    client: Any = importlib.import_module("pythontuio").TuioClient(("127.0.0.1", 0))
    server: Any = importlib.import_module("pythonosc.osc_server").BlockingOSCUDPServer
    server.__init__(client, client.server_address, client)
    client.timeout, missing, touches = PATIENCE, 0, 0
    with client, Tuio(across_plate(PLATE), port=client.server_address[1]) as tuio:
        for number, marks in enumerate(frames):
            tuio(marks, number / RATE)
            with contextlib.redirect_stdout(io.StringIO()):  # it prints each bundle
                client.handle_request()
            heard: Heard = {
                (one.session_id, round(1e5 * one.position[0]), round(1e5 * one.position[1]))
                for one in client.cursors
            }
            missing += lost(said(marks), heard)
            touches += len(marks)
    return missing, touches


def liblo(frames: list[list[Mark]]) -> tuple[int, int]:
    """Play to `oscdump`; touches not received, and all of them."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = ["oscdump", "-L", str(port)]
    missing, touches = 0, 0
    with (
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as other,
        Tuio(across_plate(PLATE), port=port) as tuio,
    ):
        lines = part(other.stdout)
        try:
            while not select.select([lines], [], [], 0.05)[0]:
                tuio([], 0.0)  # nobody was listening yet
            for number, marks in enumerate(frames, 1):
                tuio(marks, number / RATE)
                missing += lost(said(marks), until_next_frame(lines, len(marks)))
                touches += len(marks)
        finally:
            other.terminate()
    return missing, touches


def until_next_frame(lines: Iterator[str], count: int) -> Heard:
    """Read what `oscdump` prints up to the end of the next frame of so many touches."""
    heard: Heard = set()
    end = time.monotonic() + PATIENCE
    for text in lines:
        words = text.split()
        if '"set"' in words:
            name, x, y = words[words.index('"set"') + 1 :][:3]
            heard.add((int(name), round(1e5 * float(x)), round(1e5 * float(y))))
        if '"fseq"' in words:
            if len(heard) == count or time.monotonic() > end:
                return heard
            heard = set()
    return heard


def lost(expected: Heard, heard: Heard) -> int:
    """Count touches that were not heard where they are, to 2 parts of 10⁵."""
    return sum(
        not any(name == one[0] and max(abs(x - one[1]), abs(y - one[2])) <= 2 for one in heard)
        for name, x, y in expected
    )


def clients() -> Iterator[Figure]:
    """Play to both."""
    frames = played()
    found = {"python-tuio": python_tuio(frames), "liblo": liblo(frames)}
    for name, (missing, touches) in found.items():
        cells = {"touches not received": (missing, "", None, touches)}
        yield from line(TABLE, name, **cells)
    missing, touches = (sum(numbers) for numbers in zip(*found.values(), strict=True))
    cells = {"touches not received": (missing, "", at_most(0), touches)}
    yield from line(TABLE, CASE, **cells)


if __name__ == "__main__":
    run({"clients": clients}, __doc__)

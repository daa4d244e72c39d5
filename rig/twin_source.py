"""The twin as a camera: it renders in a process of its own and delivers frames in real time.

Pictures pass through a ring of shared memory; a pipe carries their number, time and truth. A frame
that nobody grabs in time is overwritten and counted as dropped, as with a real camera.
"""

from __future__ import annotations

import multiprocessing
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory

import numpy as np
from numpy.typing import NDArray

from rig.process import deaf_to_interrupts
from rig.scene import Scene
from rig.source import Frame

SLOTS = 6
START_LIMIT = 300.0  # s to be ready: the plate is factored and the pattern drawn


class TwinSource:
    """Grabs the newest frame of the twin's process; use `open_twin`."""

    def __init__(self, link: Connection, pictures: NDArray[np.uint8], numbers: NDArray[np.int64]):
        self._link = link
        self._pictures = pictures
        self._numbers = numbers
        self._started = False

    def grab(self, timeout: float) -> Frame | None:
        """See `Source.grab`.

        Raises
        ------
        OSError
            If the process of the twin has ended.
        """
        try:
            if not self._started:
                self._start()
            if not self._link.poll(timeout):
                return None
            sequence, captured, truth = self._receive()
            while self._link.poll():
                sequence, captured, truth = self._receive()
        except (EOFError, BrokenPipeError):
            raise OSError("the twin's process has ended; start the run again") from None
        slot = sequence % SLOTS
        image = self._pictures[slot].copy()
        if self._numbers[slot] != sequence:  # overwritten while it was copied
            return None
        return Frame(sequence, captured, image, truth)

    def _start(self) -> None:
        """Wait until the twin is ready, then let its time begin."""
        if not self._link.poll(START_LIMIT):
            raise OSError(f"the twin was not ready within {START_LIMIT:g} s; see its messages")
        self._receive()
        self._link.send(None)
        self._started = True

    def _receive(self):
        message = self._link.recv()
        if isinstance(message, str):
            raise OSError(message)
        return message


@contextmanager
def open_twin(scene: Scene) -> Iterator[TwinSource]:
    """Start the twin of a scene; it ends with the context, or with the process that opened it.

    It prepares itself meanwhile; its time, and so its script, begins with the first `grab`.
    """
    width, height = scene.camera.pixels if scene.camera else (0, 0)
    spawn = multiprocessing.get_context("spawn")
    memory = SharedMemory(create=True, size=SLOTS * (width * height + 8))
    here, there = spawn.Pipe()
    process = spawn.Process(
        target=_deliver, args=(scene, memory.name, there), name="touchplate-twin", daemon=True
    )
    try:
        with deaf_to_interrupts():
            process.start()
        there.close()
        source = TwinSource(here, *_views(memory, (height, width)))
        yield source
        del source
    finally:
        here.close()
        process.join(2.0)
        if process.is_alive():
            process.terminate()
            process.join()
        memory.unlink()


def _views(memory: SharedMemory, shape: tuple[int, int]):
    numbers = np.ndarray(SLOTS, np.int64, memory.buf)
    pictures = np.ndarray((SLOTS, *shape), np.uint8, memory.buf, offset=8 * SLOTS)
    return pictures, numbers


def _deliver(scene: Scene, memory_name: str, link: Connection) -> None:
    """Render frame after frame until the other end of the link closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C ends the loop, and the loop ends this
    from rig.twin import build_twin

    try:
        twin = build_twin(scene)
    except (ValueError, OSError) as error:
        link.send(str(error))
        return
    memory = SharedMemory(memory_name)
    width, height = twin.warper.camera.size
    pictures, numbers = _views(memory, (height, width))
    twin.frame(0, (), pictures[0])  # compiled and warm before time counts
    try:
        link.send(None)
        link.recv()
        start, sequence = time.monotonic(), 0
        while True:
            slot = sequence % SLOTS
            touches = twin.touches(sequence)
            numbers[slot] = -1
            twin.frame(sequence, touches, pictures[slot])
            numbers[slot] = sequence
            link.send((sequence, time.monotonic(), touches))
            late = time.monotonic() - start - (sequence + 1) / twin.rate
            time.sleep(max(0.0, -late))
            sequence += 1 + max(0, int(late * twin.rate))
    except (BrokenPipeError, ConnectionResetError, EOFError):
        pass  # the loop has ended, and so does this
    finally:
        del pictures, numbers
        memory.close()

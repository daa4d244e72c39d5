"""The twin as a camera: it renders in a process of its own and delivers frames in real time.

Images pass through a ring of shared memory; a pipe carries their number, time and truth. A frame
that nobody grabs in time is overwritten and counted as dropped, as with a real camera. The plate
stands still until the loop says that it has its reference, however long that takes.
"""

from __future__ import annotations

import multiprocessing
import time
from collections import deque
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from typing import TYPE_CHECKING, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

import fe
from rig.scene import Scene
from rig.scene.bench import CameraSection
from rig.system.frame import Frame, take_next
from rig.system.process import (
    deaf_to_interrupts,
    leave_signals_to_the_loop,
    without_script,
)

if TYPE_CHECKING:
    from rig.sources.bent_twin import BentTwin
    from rig.sources.real_twin import RealTwin
    from rig.sources.twin import Twin

SLOTS = 6
START_LIMIT = 300.0  # s for a step to be ready: a state solved, the pattern drawn
END_LIMIT = 1.0  # s to end by itself: it looks at the link once a frame


class Announced(NamedTuple):
    """A frame that lies in the ring: its number, when it was taken, s, and what touches in it."""

    sequence: int
    captured: float
    truth: tuple[fe.Touch, ...]


class TwinSource:
    """Grabs the frames of the twin's process; use `open_twin`."""

    def __init__(self, link: Connection, images: NDArray[np.uint8], numbers: NDArray[np.int64]):
        self._link = link
        self._images = images
        self._numbers = numbers
        self._started = self._prepared = False
        self._waiting: deque[Announced] = deque(maxlen=SLOTS)
        self.status = "the twin gives no images"

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
            end = time.monotonic() + timeout
            while self._waiting or self._link.poll(max(0.0, end - time.monotonic())):
                frame = self._next()
                if frame:
                    return frame
        except (EOFError, ConnectionError):
            raise OSError("the twin's process has ended; start the run again") from None
        return None

    def begin(self) -> None:
        """Let the script begin; until then the plate stands still.

        Frames that were announced meanwhile are over: the link holds some hundred of them, and a
        twin that has to wait for it leaves the next ones out.
        """
        self._release(None)

    def bend(self) -> None:
        """Let the base of a bent plate bend; it stands still there until `begin`."""
        self._release("bend")

    def _release(self, wish: str | None) -> None:
        with suppress(EOFError, ConnectionError):  # it has ended; the next grab says so
            if not self._started:
                self._start()
            self._link.send(wish)
            while self._receive() is not None:
                pass
            self._waiting.clear()

    def _next(self) -> Frame | None:
        """Next of the frames that were announced; None if it was overwritten meanwhile."""
        while self._link.poll() or not self._waiting:
            self._waiting.append(Announced(*self._receive()))
        sequence, captured, truth = take_next(self._waiting, time.monotonic())
        slot = sequence % SLOTS
        image = self._images[slot].copy()
        if self._numbers[slot] != sequence:  # overwritten while it was copied
            return None
        return Frame(sequence, captured, image, truth)

    def prepare(self, report: Callable[[int, int], None]) -> None:
        """Wait until the twin is ready; `report` takes how many of how many steps are done.

        Raises
        ------
        OSError
            If its process has ended, or says why it cannot, or does nothing for too long.
        """
        try:
            while not self._prepared:
                if not self._link.poll(START_LIMIT):
                    raise OSError(
                        f"the twin was not ready within {START_LIMIT:g} s; see its messages"
                    )
                done = self._receive()
                if done is None:
                    self._prepared = True
                else:
                    report(*done)
        except (EOFError, ConnectionError):
            raise OSError("the twin's process has ended; start the run again") from None

    def _start(self) -> None:
        """Wait until the twin is ready, then let its time begin."""
        self.prepare(lambda done, total: None)
        self._link.send(None)
        self._started = True

    def _receive(self):
        message = self._link.recv()
        if isinstance(message, str):
            raise OSError(message)
        return message


@contextmanager
def open_twin(scene: Scene) -> Generator[TwinSource]:
    """Start the twin of a scene; it ends with the context, or with the process that opened it.

    It prepares itself meanwhile; its time begins with the first `grab`, its script with `begin`.

    Raises
    ------
    ValueError
        If the scene has no twin.
    """
    width, height = _camera(scene).pixels
    spawn = multiprocessing.get_context("spawn")
    memory = SharedMemory(create=True, size=SLOTS * (width * height + 8))
    here, there = spawn.Pipe()
    process = spawn.Process(
        target=deliver, args=(scene, memory.name, there), name="touchplate-twin", daemon=True
    )
    try:
        with deaf_to_interrupts(), without_script():
            process.start()
        there.close()
        source = TwinSource(here, *_views(memory, (height, width)))
        yield source
        del source
    finally:
        with deaf_to_interrupts():  # an impatient second Ctrl-C must not leave the process behind
            here.close()
            process.join(END_LIMIT)
            if process.is_alive():
                process.kill()
                process.join()
            memory.unlink()


def _camera(scene: Scene) -> CameraSection:
    """Camera of the twin, after the checks that need no process."""
    if scene.source is None or scene.camera is None:
        raise ValueError(
            f"scene '{scene.title}' has no source of frames; add [source] with kind = \"twin\""
        )
    return scene.camera


def _views(memory: SharedMemory, shape: tuple[int, int]):
    numbers = np.ndarray(SLOTS, np.int64, memory.buf)
    images = np.ndarray((SLOTS, *shape), np.uint8, memory.buf, offset=8 * SLOTS)
    return images, numbers


def deliver(scene: Scene, memory_name: str, link: Connection) -> None:
    """Body of the twin's process: ends when the other end of the link closes."""
    leave_signals_to_the_loop()
    from rig.sources.twin import open_play

    try:
        try:
            twin = open_play(scene, lambda done, total: link.send((done, total)))
        except (ValueError, OSError) as error:
            link.send(str(error))
        else:
            _play(twin, SharedMemory(memory_name), link)
    except (EOFError, ConnectionError):
        pass  # the loop has ended, and so does this


def _play(
    twin: Twin | RealTwin | BentTwin,
    memory: SharedMemory,
    link: Connection,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], object] = time.sleep,
) -> NoReturn:
    """Render frame after frame; those for which time is too short are left out."""
    width, height = twin.warper.camera.size
    images, numbers = _views(memory, (height, width))
    a, b = twin.warper.plate
    middle = fe.Touch(a / 2, b / 2, 1.0)
    for touches in ((middle,), ()):
        twin.frame(0, touches, images[0])  # factored and compiled before time counts
    link.send(None)
    link.recv()
    start, sequence, still = clock(), 0, True
    while True:
        if still:
            twin = replace(twin, rest=sequence + 1)
        if still and link.poll():
            twin, still = _released(twin, link.recv(), sequence)
            link.send(None)
        slot = sequence % SLOTS
        touches = twin.touches(sequence)
        numbers[slot] = -1
        twin.frame(sequence, touches, images[slot])
        numbers[slot] = sequence
        link.send((sequence, _taken(twin, start + sequence / twin.rate, clock()), touches))
        late = clock() - start - (sequence + 1) / twin.rate
        sleep(max(0.0, -late))
        sequence += 1 + max(0, int(late * twin.rate))


def _taken(twin: Twin | RealTwin | BentTwin, due: float, now: float) -> float:
    """When a frame was taken, s: when it is there, or where a plate rings when it stood so."""
    from rig.sources.twin import Twin

    return due if isinstance(twin, Twin) and twin.ringing else now


def _released(
    twin: Twin | RealTwin | BentTwin, wish: str | None, sequence: int
) -> tuple[Twin | RealTwin | BentTwin, bool]:
    """Give the twin from frame `sequence` on, and whether it stands still yet."""
    if wish != "bend":
        return twin, False
    from rig.sources.bent_twin import BentTwin

    return (replace(twin, flat_frames=sequence) if isinstance(twin, BentTwin) else twin), True

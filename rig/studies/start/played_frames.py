"""Frames of the twin that were rendered before and are played like those of a camera.

A camera needs no processor, a twin needs more than the loop: so what the loop drops is seen only
with frames that are there. They are played by a process of their own, into the ring of the twin.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path

import numpy as np

import fe
from rig.scene import Scene
from rig.sources import twin_source
from rig.sources.script import STILL, Script
from rig.sources.twin import Twin, build_twin
from rig.sources.twin_source import SLOTS
from rig.system.arrays import I64, AnyArray, Grey
from rig.system.process import leave_signals_to_the_loop

PLACES = ((0.31, 0.28), (0.66, 0.71), (0.27, 0.74), (0.72, 0.33))
TOUCHES = {"touch": 1, "two": 2, "four": 4}
FORCE = 2.5  # N, which changes by a half of it
TURN, PAUSE = 3.0, 1.0  # s from one press to the next, and without a touch between
ROUND = 2 * TURN  # s after which all is as it was
SKIN, WIDE = 90, 0.3  # grey levels of the hand, and its width as a fraction of the image
FIRST = -15  # steps of priority of the player, which takes a fiftieth of a processor
CALM = 16  # images of the plate at rest, each with noise of its own
CASES = ("calm", "touch", "two", "four", "hand", "jump")


def pressed(case: str, size: tuple[float, float]) -> Script:
    """Press at as many places as the case has, over and over, while they wander."""

    def touches(time: float) -> tuple[fe.Touch, ...]:
        age = time - STILL
        if age < 0 or age % TURN < PAUSE:
            return ()
        turn = 2 * np.pi * age / ROUND
        way = 0.08 * np.sin(turn), 0.08 * np.cos(turn)
        force = FORCE * (1.0 + 0.5 * np.sin(2.0 * turn))
        return tuple(
            fe.Touch(float((x + way[0]) * size[0]), float((y + way[1]) * size[1]), float(force))
            for x, y in PLACES[: TOUCHES.get(case, 0)]
        )

    return touches


@dataclass(frozen=True, eq=False)
class Played:
    """Rendered frames: of the plate at rest, and of one round of what the case has.

    Attributes
    ----------
    rate : float, frames a second
    still, images : (N, H, W) uint8
    touches : tuple of tuple of fe.Touch
        In each of `images`.
    """

    rate: float
    still: Grey
    images: Grey
    touches: tuple[tuple[fe.Touch, ...], ...]

    def frame(self, number: int, begun: int | None) -> tuple[Grey, tuple[fe.Touch, ...]]:
        """Image and touches of a frame; `begun` is that in which the script began, or None."""
        rests = round(STILL * self.rate)
        if begun is None or number - begun < rests:
            return self.still[number % len(self.still)], ()
        index = (number - begun - rests) % len(self.images)
        return self.images[index], self.touches[index]


def render(case: str, scene: Scene) -> Played:
    """Render the frames of a case."""
    twin = build_twin(scene)
    script = pressed(case, twin.solver.plate.size)
    rests, count = round(STILL * twin.rate), round(ROUND * twin.rate)
    touches = tuple(script(STILL + number / twin.rate) for number in range(count))
    images = [twin.frame(rests + number, these) for number, these in enumerate(touches)]
    if case == "hand":
        images = [covered(image, number / count) for number, image in enumerate(images)]
    return Played(
        twin.rate, np.stack([calm(twin, k) for k in range(CALM)]), np.stack(images), touches
    )


def calm(twin: Twin, number: int) -> Grey:
    """Render the plate at rest with the noise of a number of its own."""
    return twin.frame(number, ())


def covered(image: Grey, phase: float) -> Grey:
    """Put a hand into an image, that goes over it once as `phase` goes from 0 to 1."""
    width = image.shape[1]
    left = int(width * (phase * (1.0 + WIDE) - WIDE))
    image[:, max(left, 0) : max(left + int(WIDE * width), 0)] = SKIN
    return image


def deliver(case: str, late: Path, scene: Scene, memory_name: str, link: Connection) -> None:
    """Play the frames of a case in a process of its own, in place of the twin.

    How many came late by more than a frame, because this process had to wait, is kept in the file
    `late`: a camera does not wait.
    """
    leave_signals_to_the_loop()
    played = render(case, scene)
    memory = SharedMemory(memory_name)
    shape = played.images.shape[1:]
    numbers: I64 = np.ndarray(SLOTS, np.int64, memory.buf)
    images: AnyArray = np.ndarray((SLOTS, *shape), np.uint8, memory.buf, offset=8 * SLOTS)
    counted = [0]
    _go_first()
    try:
        for _ in play(played, images, numbers, link):
            counted[0] += 1
            late.write_text(str(counted[0]), encoding="utf-8")
    except (EOFError, ConnectionError):
        pass  # the loop has ended


def _go_first() -> None:
    """Go before other processes, where the system lets this one: a camera waits for none."""
    if sys.platform != "win32":
        with suppress(OSError):
            os.nice(FIRST)


def play(
    played: Played,
    images: AnyArray,
    numbers: I64,
    link: Connection,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], object] = time.sleep,
) -> Iterator[float]:
    """Announce each frame at its time, those that are late at once; gives how late each came, s."""
    link.send(None)
    link.recv()
    start, number, begun = clock(), 0, None
    while True:
        due = start + (number + 1) / played.rate
        sleep(max(0.0, due - clock()))
        if begun is None and link.poll():
            link.send(link.recv())
            begun = number + 1
        image, touches = played.frame(number, begun)
        slot = number % SLOTS
        numbers[slot] = -1
        images[slot] = image
        numbers[slot] = number
        now = clock()
        link.send((number, now, touches))
        if begun is None:  # a loop that gets ready takes none, and a full link holds this up
            start = max(start, clock() - (number + 1) / played.rate)
        elif now - due > 1 / played.rate:
            yield now - due
        number += 1


@contextmanager
def in_place_of_the_twin(case: str, late: Path) -> Generator[None]:
    """Let `open_twin` play the frames of a case while the block runs."""
    render_live = twin_source.deliver
    twin_source.deliver = partial(deliver, case, late)
    try:
        yield
    finally:
        twin_source.deliver = render_live


def main(words: list[str]) -> None:
    """Run `touchplate` on the frames of a case: CASE LATE WORD ..."""
    from rig.cli import application

    case, late, *rest = words
    with in_place_of_the_twin(case, Path(late)):
        application(rest)(rest)

"""Scripted hands through the whole live loop: rendered, estimated, tracked and read."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import fe
import rig
from rig.live.bench import build_bench
from rig.live.gestures import Gesture
from rig.live.loop import Loop
from rig.scene import Scene
from rig.sources.script import Script
from rig.sources.twin import Twin, build_twin
from rig.studies.gestures.script import PLATE, RATE, Made
from rig.system.frame import Frame
from rig.system.newcomers import Newcomers

FINGERS = 10
CHANGES = {
    "plate.size": PLATE,
    "plate.thickness": 1.5,  # mm: so soft that 0.5 N is placed to less than `gestures.COARSE`
    "camera.pixels": (1280, 1024),
    "camera.rate": RATE,
}
REST = 4.0  # s after the script in which the last gestures are reported


@dataclass(frozen=True)
class Followed:
    """What the loop made of a script.

    Attributes
    ----------
    gestures : tuple of Gesture
    frames : int
    seconds : float, s
        CPU time of the loop, without that in which images were made.
    """

    gestures: tuple[Gesture, ...]
    frames: int
    seconds: float


class HandsSource:
    """Frames of a twin one after the other at `RATE`, those of the plate at rest before 0 s.

    Attributes
    ----------
    now : float, s
        Time of the last frame.
    spent : float, s
        CPU time in which images were made.
    """

    status = "scripted hands"

    def __init__(self, twin: Twin, seconds: float):
        self.now = self.spent = 0.0
        self._twin, self._next = twin, 0
        self._end = twin.rest + round(seconds * RATE)

    def grab(self, timeout: float) -> Frame | None:
        """See `Source.grab`."""
        del timeout  # a frame is always there
        number, twin, began = self._next, self._twin, time.process_time()
        if number >= self._end:
            raise EOFError("the hands have gone")
        touches = twin.touches(number)
        image = twin.frame(number, touches).copy()
        self._next, self.now = number + 1, (number - twin.rest) / RATE
        self.spent += time.process_time() - began
        return Frame(number, self.now, image, touches)


def follow_hands(made: list[Made], seconds: float) -> Followed:
    """Follow a script of so many seconds frame by frame, none of them dropped."""
    scene = _scene()
    bench = build_bench(scene, lambda done, total: None)
    twin = replace(build_twin(scene), script=_pressing(made), rest=bench.reference_frames)
    source, new = HandsSource(twin, seconds + REST), Newcomers[Gesture]()
    running = Loop(bench, source, lambda: source.now)
    running.get_ready()
    began, made_before = time.process_time(), source.spent
    gestures = [gesture for snapshot in running for gesture in new(snapshot.gestures)]
    spent = time.process_time() - began - (source.spent - made_before)
    return Followed(tuple(gestures), running.pace.frames, spent)


def _scene() -> Scene:
    """Load the twin with the plate of the script, for ten fingers: a file may ask for four."""
    scene = rig.load("twin", CHANGES)
    touches = scene.touches and scene.touches.model_copy(update={"max_touches": FINGERS})
    return scene.model_copy(update={"touches": touches, "comparison": None})


def _pressing(made: list[Made]) -> Script:
    def touches(now: float) -> tuple[fe.Touch, ...]:
        return tuple(fe.Touch(*finger.tolist()) for one in made for finger in one.at(now))

    return touches

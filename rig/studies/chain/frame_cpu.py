"""What a frame of 1024² costs one thread's processor, by what it shows.

Parts: calm, touch, several, shaken, shadow, hand. The shipped twin is rendered at 30 frames a
second and each frame goes through everything that the loop does with it: touches from the whole
pattern, the strain map and the touches from strain, and the tracker. One finger wanders in all but
calm and several; the camera is shaken along both axes, by 3 px at 7 Hz and 4.3 Hz; a shadow of four
tenths with soft edges crosses the plate in two seconds; a hand ends beside the finger and leaves at
the right. The bar is of the median.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import fe
import rig
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.tracker import FrameProcessor
from rig.report.figure import Figure, at_most
from rig.sources.twin import Twin, build_twin
from rig.studies.chain.run_time import arm, wandering
from rig.studies.study import line, run, times
from rig.system.frame import Frame
from rig.system.timing import Stopwatch

FRAMES, REFERENCE, RATE = 120, 16, 30.0
SHAKE, HERTZ = 3.0, (7.0, 4.3)  # px, along x and y
DARK, SOFT, CROSSING = 0.4, 0.08, 2.0  # of the light, of the width, s
TABLE = "CPU of a frame of 1024², one thread"

Touches = Callable[[int, "Stage"], tuple[fe.Touch, ...]]
Image = Callable[["Stage", int, tuple[fe.Touch, ...]], NDArray[np.uint8]]


class Stage(NamedTuple):
    """The twin, and what follows its plate."""

    twin: Twin
    follower: FrameProcessor
    size: tuple[float, float]
    expected: int


class Case(NamedTuple):
    """What presses, what is seen, and the bar of the median, ms."""

    name: str
    touches: Touches
    image: Image
    bar: float


@cache
def stage() -> Stage:
    """Build the shipped twin and take its reference."""
    scene = rig.load("twin")
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    rest = average_reference([twin.frame(number, ()) for number in range(REFERENCE)])
    follower = FrameProcessor(bench, rest, Stopwatch(time.monotonic), time.monotonic)
    return Stage(twin, follower, bench.plate.size, bench.max_touches)


def nobody(number: int, on: Stage) -> tuple[fe.Touch, ...]:
    """Touch nothing."""
    return ()


def one(number: int, on: Stage) -> tuple[fe.Touch, ...]:
    """Wander over the plate."""
    return (wandering(number / FRAMES, on.size),)


def several(number: int, on: Stage) -> tuple[fe.Touch, ...]:
    """Press with two fingers more than the scene expects, on a circle that turns slowly."""
    count = on.expected + 2
    turns = 2 * np.pi * (np.arange(count) / count + 0.2 * number / FRAMES)
    x, y = (side * (0.5 + 0.3 * wave) for side, wave in zip(on.size, _circle(turns), strict=True))
    force = 2.5 + np.sin(turns + 6.0 * number / FRAMES)
    return tuple(fe.Touch(*place) for place in np.c_[x, y, force].tolist())


def _circle(turns: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return np.cos(turns), np.sin(turns)


def plain(on: Stage, number: int, touches: tuple[fe.Touch, ...]) -> NDArray[np.uint8]:
    """Render what is there."""
    return on.twin.frame(1000 + number, touches)


def shaken(on: Stage, number: int, touches: tuple[fe.Touch, ...]) -> NDArray[np.uint8]:
    """Render from a camera that is shaken."""
    x, y = (SHAKE * np.sin(2 * np.pi * hertz * number / RATE) for hertz in HERTZ)
    return replace(on.twin, shift=(float(x), float(y))).frame(1000 + number, touches)


def shaded(on: Stage, number: int, touches: tuple[fe.Touch, ...]) -> NDArray[np.uint8]:
    """Let a shadow cross the plate, a third of the image wide."""
    light = plain(on, number, touches)
    along = np.linspace(0.0, 1.0, light.shape[1])
    middle = (number / RATE / CROSSING) % 1.0
    rise, fall = (np.tanh((along - middle + half) / SOFT) for half in (1 / 6, -1 / 6))
    return np.rint(light * (1.0 - DARK * (rise - fall) / 2.0)).clip(0, 255).astype(np.uint8)


def covered(on: Stage, number: int, touches: tuple[fe.Touch, ...]) -> NDArray[np.uint8]:
    """Put an arm into the image that ends beside the finger."""
    return arm(plain(on, number, touches), touches[0])


CASES = {
    "calm": Case("calm", nobody, plain, 10.0),
    "touch": Case("touch", one, plain, 11.0),
    "several": Case("two touches more than expected", several, plain, 20.0),
    "shaken": Case("camera shaken by 3 px", one, shaken, 20.0),
    "shadow": Case("moving shadow", one, shaded, 15.0),
    "hand": Case("hand", one, covered, 15.0),
}


def measured(case: Case, frames: int = FRAMES) -> Iterator[Figure]:
    """Follow a case from the plate at rest on, and give its times."""
    on = stage()
    taken, counts = follow(case, on, frames)  # of more than expected, as many as are expected
    pressed = len(case.touches(0, on))
    wanted = min(pressed, on.expected)
    yield from line(
        TABLE,
        case.name,
        **times(taken, at_most(case.bar)),
        pressed=(pressed, "touches"),
        right_count=(100.0 * float(np.mean(np.equal(counts, wanted))), "%", None, frames),
    )


def follow(case: Case, on: Stage, frames: int) -> tuple[list[float], list[int]]:
    """CPU time of each frame, ms, and how many touches were found in it."""
    taken: list[float] = []
    counts: list[int] = []
    for number in range(frames):
        touches = case.touches(number, on)
        frame = Frame(number, time.monotonic(), case.image(on, number, touches), touches)
        began = time.thread_time()
        found = on.follower.process(frame)
        taken.append(1e3 * (time.thread_time() - began))
        counts.append(found.frame_estimate.estimate.count)
    return taken, counts


PARTS = {name: partial(measured, case) for name, case in CASES.items()}

if __name__ == "__main__":
    run(PARTS, __doc__)

"""How long a frame takes from its capture to the touches, stage by stage, with the error.

Parts: sparse (the pattern in 400 tiles of 49 px), pattern (tiles of 16 px) and strain (as shipped:
the strain map of the same frames as well, whose error is then reported). The camera has 1024² px;
one finger of 1 to 3 N strokes over a plate of 2 mm. All frames are rendered beforehand, so that
nothing else computes. Times are of the wall.
"""

import time
from collections.abc import Iterator
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import fe
import rig
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.pace import LATENCY
from rig.live.run_score import RunScore
from rig.live.tracker import FrameProcessor
from rig.report.figure import Bar, Figure, at_most
from rig.sources.twin import build_twin
from rig.studies.study import line, run
from rig.system.frame import Frame
from rig.system.timing import Stopwatch

FRAMES = 200
WAYS: dict[str, tuple[dict[str, Any], Bar | None]] = {
    "sparse": ({"dic.tile": 49, "estimator.modes": 150, "comparison": None}, at_most(10.0)),
    "pattern": ({"comparison": None}, None),
    "strain (default)": ({}, at_most(15.0)),
}
"""Settings by way, and the bar of the time in ms that 95 % of the frames keep."""
Pressed = tuple[NDArray[np.uint8], tuple[fe.Touch, ...]]


def stroke(count: int) -> list[tuple[fe.Touch, ...]]:
    """One finger that lands, strokes over the plate while it presses harder, and leaves."""
    along = np.linspace(0.0, 1.0, count)
    force = (1.0 + 2.0 * along) * np.clip(np.minimum(along, 1.0 - along) * count / 9.0, 0.0, 1.0)
    x, y = 60.0 + 130.0 * along, 127.0 + 60.0 * np.sin(2.0 * np.pi * along)
    return [(fe.Touch(*place),) if place[2] else () for place in np.c_[x, y, force].tolist()]


@cache
def photograph() -> tuple[list[NDArray[np.uint8]], list[Pressed]]:
    """Images at rest and under the stroke, with its touches."""
    twin, touches = build_twin(rig.load("twin")), stroke(FRAMES)
    rest = [twin.frame(k, ()) for k in range(16)]
    return rest, [(twin.frame(100 + k, one), one) for k, one in enumerate(touches)]


def way(name: str) -> Iterator[Figure]:
    """Follow the stroke in one way."""
    (settings, bar), (rest, frames) = WAYS[name], photograph()
    bench = build_bench(rig.load("twin", settings), lambda done, total: None)
    watch, score = Stopwatch(time.monotonic), RunScore(bench.min_force)
    processor = FrameProcessor(bench, average_reference(rest), watch, time.monotonic)
    for number, (image, touches) in enumerate(frames):
        seen = processor.process(Frame(number, time.monotonic(), image, touches))
        score.add(seen.frame_estimate.from_strain or seen.frame_estimate.estimate, touches)
    (middle, late), scores = watch.quantiles(LATENCY), score.summary()
    yield from line(
        "From capture to touches, 1024², one touch",
        f"{name}, {len(processor.chain.reference.hessian)} tiles",
        median=(middle, "ms"),
        p95=(late, "ms", bar, FRAMES),
        place=(scores["position_median_mm"], "mm, median"),
        force=(scores["force_median_percent"], "%, median"),
        missed=(scores["misses"], "frames"),
        false_touches=scores["false_touches"],
    )
    for stage, median, slow in watch.table():
        if stage != LATENCY:
            yield from line(
                f"Stages of a frame, {name}", stage, median=(median, "ms"), p95=(slow, "ms")
            )


PARTS = {name.partition(" ")[0]: partial(way, name) for name in WAYS}

if __name__ == "__main__":
    run(PARTS, __doc__)

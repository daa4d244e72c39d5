"""Print how long a frame takes from its capture to the touches, stage by stage, with the error.

Usage: ``python benchmarks/live.py [--cpu] [--frames 200] [WAY ...]``; ways are sparse (the pattern
in 400 tiles of 49 px), pattern (tiles of 16 px) and strain (the strain map of the same frames as
well, whose error is then printed). The camera has 1024² px; one finger of 1 to 3 N strokes over a
plate of 2 mm. All frames are rendered beforehand, so that nothing else computes. Times are of the
wall; with --cpu those of the one thread that works, which compare on a machine that others use.
"""

import sys
import time

import numpy as np

import fe
import rig
from rig.live.baseline import take_zero
from rig.live.bench import build_bench
from rig.live.run_score import Tally
from rig.live.tracker import LATENCY, Follower
from rig.sources.twin import build_twin
from rig.system.frame import Frame
from rig.system.timing import Stopwatch

WALL = time.monotonic
BAR = 10.0  # ms, p95 of capture to touches
WAYS = {
    "sparse": {"dic.tile": 49, "estimator.modes": 150, "comparison": None},
    "pattern": {"comparison": None},
    "strain": {},
}


def stroke(count: int) -> list[tuple[fe.Touch, ...]]:
    """One finger that lands, strokes over the plate while it presses harder, and leaves."""
    share = np.linspace(0.0, 1.0, count)
    force = (1.0 + 2.0 * share) * np.clip(np.minimum(share, 1.0 - share) * count / 9.0, 0.0, 1.0)
    x, y = 60.0 + 130.0 * share, 127.0 + 60.0 * np.sin(2.0 * np.pi * share)
    return [(fe.Touch(*place),) if place[2] else () for place in np.c_[x, y, force].tolist()]


def photograph(count: int):
    """Pictures at rest and under the stroke, with its touches."""
    twin, touches = build_twin(rig.load("twin")), stroke(count)
    rest = [twin.frame(k, ()) for k in range(16)]
    return rest, [(twin.frame(100 + k, one), one) for k, one in enumerate(touches)]


def run(way: str, rest, frames, clock):
    """Stopwatch, scores and number of tiles of a run."""
    bench = build_bench(rig.load("twin", WAYS[way]), lambda done, total: None)
    watch, tally = Stopwatch(clock), Tally(bench.least_force)
    follower = Follower(bench, take_zero(rest), watch, clock)
    for number, (image, touches) in enumerate(frames):
        seen = follower.see(Frame(number, clock(), image, touches))
        tally.add(seen.sensed.from_strain or seen.sensed.estimate, touches)
    return watch, tally.summary(), len(follower.chain.reference.hessian)


def main(*arguments: str) -> None:
    """Print a table a way."""
    given = list(arguments)
    count = int(given.pop(given.index("--frames") + 1)) if "--frames" in given else 200
    wanted = [name for name in given if name in WAYS] or list(WAYS)
    clock = time.thread_time if "--cpu" in given else WALL
    rest, frames = photograph(count)
    for way in wanted:
        watch, scores, tiles = run(way, rest, frames, clock)
        median, late = watch.quantiles(LATENCY)
        print(f"{way}: {tiles} tiles, {count} frames, one touch", flush=True)
        print(f"  capture to touches   {median:6.1f} ms, p95 {late:6.1f} ms   bar p95 {BAR:g} ms")
        for name, middle, slow in watch.table():
            if name != LATENCY:
                print(f"  {name:20s} {middle:6.2f} ms, p95 {slow:6.2f} ms")
        print(
            f"  error                {scores['position_median_mm']:.2f} mm, p95"
            f" {scores['position_p95_mm']:.2f} mm, force {scores['force_median_percent']:.1f} %;"
            f" {scores['misses']} missed, {scores['false_touches']} false of {scores['frames']}"
        )


if __name__ == "__main__":
    main(*sys.argv[1:])

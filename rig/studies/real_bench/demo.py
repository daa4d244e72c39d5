"""The demo as a newcomer sees it: the tour of `bench-real` on the calibration that comes with it.

Parts: few (every frame of one tour of 25 s), tours (of four), outrun (one frame of three of twelve
tours, as a machine shows them that does not keep up), lost (two to seven frames of twelve tours are
left out, and now and then twenty to sixty), live (`touchplate run` itself, three times 3000 frames,
as fast as the machine is). Truth is the whole plate of von Kármán on its own mesh, seen by a camera
that is otherwise than the scene says; the loop has the scene, the shipped calibration of nine
presses, and learns on while it runs. Place and force: each touch of frames in which all that press
with 0.5 N or more are found and nothing else; inside 1 and 2 σ: x, y and F each, of frames that are
FOUND.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import repeat
from typing import Any

import numpy as np

import fe
import rig
from models import Estimate, Result
from rig.calibration.store import calibration_beside
from rig.live.bench import build_bench
from rig.live.loop import Loop
from rig.report.figure import Figure, at_most
from rig.sources.real_twin import RealTwin
from rig.sources.script import TOUR_LENGTH
from rig.sources.twin import open_play
from rig.studies.real_bench.as_it_is import INSIDE
from rig.studies.real_bench.twin_truth import SCENE
from rig.studies.study import line, run
from rig.system.arrays import F64
from rig.system.frame import Frame

TABLE = "The demo as a newcomer sees it"
WEAKEST = 0.5  # N
RUNS, FRAMES = 3, 3000
_SHORT, _LONG = (3, 9), (21, 62)  # frames from one that is seen to the next
_OFTEN, _SEED = 0.06, 17  # part of the long ones
LIVE = "--headless", "--json", "--frames", str(FRAMES)
PROGRAM = "from rig.cli import main; main()"
PLACE, FAR, FORCE, NONE = at_most(0.4), at_most(1.0), at_most(1.5), at_most(0.0)


class TourSource:
    """Frames of a twin one after the other, the first ones of the plate at rest.

    Attributes
    ----------
    now : float, s
        Time of the last frame.
    """

    status = "a tour"

    def __init__(self, twin: RealTwin, references: int, seconds: float, steps: Iterator[int]):
        self.now = 0.0
        self._twin, self._next = twin, 0
        self._references, self._steps = references, steps
        self._end = references + round(seconds * twin.rate)

    def grab(self, timeout: float) -> Frame | None:
        """See `Source.grab`."""
        del timeout  # a frame is always there
        number, twin = self._next, self._twin
        if number >= self._end:
            raise EOFError("the tour is over")
        step = 1 if number + 1 < self._references else next(self._steps)
        self._next, self.now = number + step, number / twin.rate
        touches = twin.touches(number)
        return Frame(number, self.now, twin.frame(number, touches).copy(), touches)


@dataclass
class Seen:
    """What a tour has shown, frame by frame."""

    place: list[float] = field(default_factory=list[float])
    force: list[float] = field(default_factory=list[float])
    within: list[F64] = field(default_factory=list[F64])
    pressed: int = 0
    alone: int = 0
    phantoms: int = 0
    missed: int = 0
    false: int = 0

    def add(self, estimate: Estimate, truth: tuple[fe.Touch, ...]) -> None:
        """Compare what is found with what presses."""
        if not truth:
            self.alone += 1
            self.false += estimate.count
            return
        self.pressed += 1
        self.phantoms += estimate.count > len(truth)
        strong = all(touch.force >= WEAKEST for touch in truth)
        self.missed += strong and estimate.count < len(truth)
        if strong and estimate.count == len(truth):
            self._errors(estimate, truth)

    def _errors(self, estimate: Estimate, truth: tuple[fe.Touch, ...]) -> None:
        true = np.array([(t.x, t.y, t.force) for t in truth])
        found = np.column_stack([estimate.xy, estimate.force])
        orders = ([0],) if len(true) == 1 else ([0, 1], [1, 0])
        off = min((found[o] - true for o in orders), key=lambda d: np.hypot(*d[:, :2].T).sum())
        order = min(orders, key=lambda o: np.hypot(*(found[o] - true)[:, :2].T).sum())
        self.place += np.hypot(*off[:, :2].T).tolist()
        self.force += (off[:, 2] / true[:, 2]).tolist()
        if estimate.result is Result.FOUND:
            sigma = np.sqrt(np.diag(estimate.covariance)).reshape(-1, 3)[order]
            self.within.append((off / sigma).ravel())


def tours(count: int, every: int = 1) -> Iterator[Figure]:
    """Score so many tours, of which one frame of some is seen."""
    case = f"{SCENE}, shipped calibration"
    if every > 1:
        case = f"{SCENE}, one frame of {every}, {count * TOUR_LENGTH / 60.0:.0f} minutes"
    yield from _toured(case, count, repeat(every))


def lost(count: int) -> Iterator[Figure]:
    """Score so many tours, of which frames are lost for up to four seconds."""
    case = f"{SCENE}, frames lost, {count * TOUR_LENGTH / 60.0:.0f} minutes"
    yield from _toured(case, count, _kept_frames(np.random.default_rng(_SEED)))


def _kept_frames(rng: np.random.Generator) -> Iterator[int]:
    """From each frame that is seen to the next."""
    while True:
        yield int(rng.integers(*(_LONG if rng.random() < _OFTEN else _SHORT)))


def _toured(case: str, count: int, steps: Iterator[int]) -> Iterator[Figure]:
    scene = rig.load(SCENE)
    twin = open_play(scene)
    bench = build_bench(scene, lambda done, total: None, calibration_beside(SCENE))
    if not isinstance(twin, RealTwin):
        raise ValueError(f"scene '{SCENE}' has no source.departure; write one")
    twin = replace(twin, rest=bench.reference_frames)
    source, seen = TourSource(twin, bench.reference_frames, count * TOUR_LENGTH, steps), Seen()
    loop = Loop(bench, source, lambda: source.now)
    began, spent = time.process_time(), list[float]()
    for snapshot in loop:
        if snapshot.estimate is not None and snapshot.truth is not None:
            seen.add(snapshot.estimate, twin.touches(snapshot.sequence))
        spent.append(time.process_time() - began)
        began = time.process_time()
    yield from _figures(case, seen, loop.summary()["learned"], float(np.median(spent)))


def _figures(case: str, seen: Seen, learned: dict[str, float], seconds: float) -> Iterator[Figure]:
    count, inside = len(seen.place), np.abs(np.concatenate(seen.within))
    one, two = (100.0 * float(np.mean(inside < limit)) for limit in (1.0, 2.0))
    yield from line(
        TABLE,
        case,
        **{
            "place, median": (float(np.median(seen.place)), "mm", PLACE, count),
            "place, p95": (float(np.quantile(seen.place, 0.95)), "mm", FAR, count),
            "force": (100.0 * float(np.median(np.abs(seen.force))), "%", FORCE, count),
            "inside 1 σ": (one, "%", INSIDE[0], len(inside)),
            "inside 2 σ": (two, "%", INSIDE[1], len(inside)),
            "frames with a phantom": (seen.phantoms, "", NONE, seen.pressed),
            "missed": (seen.missed, "", None, seen.pressed),
            "false touches": (seen.false, "", NONE, seen.alone),
            "learned": (learned["touches"], "touches"),
            "strange": (learned["strange"], "touches"),
            "frame, rendered and estimated": (1e3 * seconds, "CPU ms"),
        },
    )


def live() -> Iterator[Figure]:
    """Count what is found that is not there while the loop runs in real time."""
    runs = [run_summary() for _ in range(RUNS)]
    frames = sum(each["pattern"]["frames"] for each in runs)
    yield from line(
        TABLE,
        f"{SCENE}, live, {RUNS} runs",
        **{
            "false touches": (
                sum(each["pattern"]["false_touches"] for each in runs),
                "",
                NONE,
                frames,
            ),
            "frames": (frames, ""),
            "dropped": (sum(each["dropped"] for each in runs), ""),
        },
    )


def run_summary() -> dict[str, Any]:
    """Run the scene, knowing nothing of earlier runs; what it says at its end."""
    with tempfile.TemporaryDirectory() as folder:
        said = subprocess.run(
            [sys.executable, "-c", PROGRAM, "run", SCENE, *LIVE],
            cwd=folder,  # where what a run learns is kept
            stdout=subprocess.PIPE,
            check=True,
        )
    return json.loads(said.stdout)


PARTS = {
    "few": partial(tours, 1),
    "tours": partial(tours, 4),
    "outrun": partial(tours, 12, 3),
    "lost": partial(lost, 12),
    "live": live,
}

if __name__ == "__main__":
    run(PARTS, __doc__)

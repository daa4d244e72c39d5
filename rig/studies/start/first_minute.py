"""The first run after an install: frames dropped after the first one shown, by what it shows.

Parts: fresh, again, and fresh_CASE for one case of fresh. Each case is the command itself on the
shipped twin of 1024², headless, with frames that were rendered before and are played as a camera
gives them; *fresh* with empty caches, nothing compiled and a process beside it that never rests,
*again* with what was compiled and cached before and nothing beside it. A frame counts as dropped if
it was given a number and the loop did not sense it. *Late* are frames that the player gave late by
more than the time of a frame, because it had to wait for a processor itself: a camera does not
wait, so of those that were dropped so many may be due to the player.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from rig.cli import THREADS
from rig.report.figure import Figure, at_most
from rig.studies.start.played_frames import CASES
from rig.studies.study import line, run

FRAMES = 1000
SHIFT = "--set=source.shift=[6,-4]"  # px, of the bump
PROGRAM = "import sys; from rig.studies.start.played_frames import main; main(sys.argv[1:])"
TABLE = f"The first run after an install, {FRAMES} frames of 1024² at 30 a second"


def fresh(cases: Iterable[str]) -> Iterator[Figure]:
    """Run each case with empty caches, and beside a process that never rests."""
    for case in cases:
        with tempfile.TemporaryDirectory() as folder, busy():
            yield from _dropped(f"{case}, empty caches, busy machine", case, Path(folder))


def again() -> Iterator[Figure]:
    """Run each case with the caches of an earlier run."""
    with tempfile.TemporaryDirectory() as folder:
        _run("calm", Path(folder), 1)
        for case in CASES:
            yield from _dropped(f"{case}, caches full", case, Path(folder))


@contextmanager
def busy() -> Generator[None]:
    """Keep one processor busy while the block runs."""
    worker = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        yield
    finally:
        worker.kill()
        worker.wait()


def _dropped(name: str, case: str, caches: Path) -> Iterator[Figure]:
    """Give the figures of one run beside the bar, and how busy the machine was."""
    said, late, took, load = _run(case, caches, FRAMES)
    yield from line(
        TABLE,
        name,
        dropped=(said["dropped"], "frames", at_most(0), FRAMES),
        late=(late, "frames"),
        rate=(said["fps"], "frames/s"),
        latency=(said["latency_ms"]["median"], "ms"),
        p95=(said["latency_ms"]["p95"], "ms"),
        all=(took, "s"),
        load=(load, "processes"),
    )


def _run(case: str, caches: Path, frames: int) -> tuple[dict[str, Any], float, float, float]:
    """Run the command on a case; what it says, frames late, how long, and the load at its end."""
    late = caches / "late.txt"
    late.write_text("0", encoding="utf-8")
    words = [case, str(late), "run", "twin", f"--frames={frames}", "--headless", "--json"]
    words += [SHIFT] if case == "jump" else []
    kept = {"NUMBA_CACHE_DIR": str(caches / "numba"), "TOUCHPLATE_CACHE": str(caches / "plates")}
    began = time.perf_counter()
    ended = subprocess.run(
        [sys.executable, "-c", PROGRAM, *words],
        env=os.environ | dict.fromkeys(THREADS, "1") | kept,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if ended.returncode:
        raise SystemExit(f"{case}: {ended.stderr[-500:]}")
    took = time.perf_counter() - began
    said = json.loads(ended.stdout)
    return said, float(late.read_text(encoding="utf-8")), took, os.getloadavg()[0]


PARTS = {"fresh": partial(fresh, CASES), "again": again} | {
    f"fresh_{case}": partial(fresh, (case,)) for case in CASES
}

if __name__ == "__main__":
    run(PARTS, __doc__)

"""The first run after an install: frames dropped after the first one shown, by what it shows.

Parts: fresh, again, alone. Each case is the command itself on the shipped twin of 1024², headless;
*fresh* with nothing compiled, *again* with what was compiled before. A frame counts as dropped if
the source gave it a number and the loop did not sense it: because the loop was at work, or because
the twin, which must render in the time of a frame on the same machine, was late itself. *Alone*
nothing is done with the frames: what is dropped then, the twin left out.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rig.cli import THREADS
from rig.report.figure import Figure, at_most
from rig.studies.study import line, run

FRAMES = 1000
CASES = ("calm", "touch", "two", "four", "hand", "jump")
SHIFT = "--set=source.shift=[6,-4]"  # px, of the bump
PROGRAM = Path(__file__).with_name("pressed_twin.py")
TABLE = f"The first run after an install, {FRAMES} frames of 1024² at 30 a second"


def fresh() -> Iterator[Figure]:
    """Run each case with empty caches of kernels."""
    for case in CASES:
        with tempfile.TemporaryDirectory() as kernels:
            yield from _dropped(f"{case}, nothing compiled", case, kernels)


def again() -> Iterator[Figure]:
    """Run each case with the kernels of an earlier run."""
    with tempfile.TemporaryDirectory() as kernels:
        _run("calm", kernels, 1)
        for case in CASES:
            yield from _dropped(f"{case}, compiled", case, kernels)


def alone() -> Iterator[Figure]:
    """Let the twin of each case run beside nothing."""
    for case in CASES:
        words = [sys.executable, PROGRAM, case, "alone", str(FRAMES)]
        said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
        yield from line(TABLE, f"{case}, the twin alone", dropped=(float(said), "frames"))


def _dropped(name: str, case: str, kernels: str) -> Iterator[Figure]:
    """Give the figures of one run beside the bar, and how busy the machine was with others."""
    said, took, others = _run(case, kernels, FRAMES)
    yield from line(
        TABLE,
        name,
        dropped=(said["dropped"], "frames", at_most(0), FRAMES),
        rate=(said["fps"], "frames/s"),
        latency=(said["latency_ms"]["median"], "ms"),
        p95=(said["latency_ms"]["p95"], "ms"),
        all=(took, "s"),
        load=(others, "processes"),
    )


def _run(case: str, kernels: str, frames: int) -> tuple[dict[str, Any], float, float]:
    """Run the command on a case; what it says, how long it took, and the load at its end."""
    words = ["run", "twin", f"--frames={frames}", "--headless", "--json"]
    words += [SHIFT] if case == "jump" else []
    began = time.perf_counter()
    ended = subprocess.run(
        [sys.executable, PROGRAM, case, *words],
        env=os.environ | dict.fromkeys(THREADS, "1") | {"NUMBA_CACHE_DIR": kernels},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if ended.returncode:
        raise SystemExit(f"{case}: {ended.stderr[-500:]}")
    return json.loads(ended.stdout), time.perf_counter() - began, os.getloadavg()[0]


PARTS = {"fresh": fresh, "again": again, "alone": alone}

if __name__ == "__main__":
    run(PARTS, __doc__)

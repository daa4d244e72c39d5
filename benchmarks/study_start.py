"""Start-up: commands and packages, each in a process of its own.

Parts: commands, packages. Wall times; the median of five starts after one that fills the caches.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator

import numpy as np
from dic_pictures import eight_bit, speckle
from PIL import Image
from study import line, run

from rig.report.figure import Figure, judged

HEAVY = [
    "torch",
    "kornia",
    "optuna",
    "sklearn",
    "dask",
    "numba",
    "scipy",
    "cv2",
    "skimage",
    "matplotlib",
    "h5py",
    "pydantic",
    "starlette",
    "uvicorn",
    "pygame",
    "usb",
    "linuxpy",
    "pylsl",
]
REPEATS = 5
TAIL = f"; import sys; print(*[m for m in {HEAVY} if m in sys.modules])"


def commands() -> Iterator[Figure]:
    """Time `--help`, `show` and `correlate`, and name the heavy modules that each imports."""
    table = "Start of a command"
    with tempfile.TemporaryDirectory() as folder:
        pair = [f"{folder}/{name}.png" for name in ("before", "after")]
        for path, shift in zip(pair, ((0.0, 0.0), (0.4, 0.2)), strict=True):
            Image.fromarray(eight_bit(speckle(512, shift))).save(path)
        fields = [*pair, "--out", f"{folder}/fields", "--force"]
        for words, most in (
            (["--help"], 0.3),
            (["show", "twin"], 1.0),
            (["show", "paper-one"], 1.0),
            (["correlate", *fields], 2.0),
            (["doctor"], None),
        ):
            name = "touchplate " + " ".join(word for word in words[:2] if folder not in word)
            code = (
                "from rig.cli import application\n"
                f"words = {words!r}\n"
                "try: application(words)(words)\n"
                "except SystemExit: pass\n" + TAIL[2:]
            )
            seconds, loaded = started(["-c", code])
            time_, *rest = line(table, name, time=(f"{seconds:.2f}", "s"), modules=loaded)
            yield judged(time_, seconds, most, f"≤ {most:g} s") if most else time_
            yield from rest


def packages() -> Iterator[Figure]:
    """Time the import of each package alone, and name the heavy modules that came with it."""
    for package in ("dic", "fe", "synthetic", "models", "rig"):
        seconds, loaded = started(["-c", f"import {package}{TAIL}"])
        yield from line(
            "Import of a package", package, time=(f"{seconds:.2f}", "s"), modules=loaded or "none"
        )


def started(words: list[str]) -> tuple[float, str]:
    """Median wall time of a Python process, s, and the last line that it printed."""
    taken = []
    for _ in range(1 + REPEATS):
        began = time.perf_counter()
        ended = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=True)
        taken.append(time.perf_counter() - began)
    return float(np.median(taken[1:])), ended.stdout.splitlines()[-1].strip()


PARTS = {"commands": commands, "packages": packages}

if __name__ == "__main__":
    run(PARTS, __doc__)

"""A whole test: 500 frames of 5 MP into one file, and the bytes of one that was killed.

Parts: rate, some, killed. The rate is wall time on all cores of the machine and asks for an idle
one; the frames are six images under 500 names, so that reading costs what it costs. `some` measures
the same on fewer frames, as many as its samples say.
"""

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from rig.report.figure import Figure, at_least, at_most
from rig.studies.correlation.images import eight_bit, speckle
from rig.studies.study import line, run

SIDE, STEP, FRAMES, IMAGES = 2240, 8, 500, 6  # 5.0 MP
BEFORE, SOME = 50, 200  # frames that memory is compared with, and those of a short run
SMALL, FEW = 512, 500  # px and frames of the test that is killed
KILLED = 3
NOISE = 2.0  # grey levels
TABLE = "500 frames into one file"


def rate() -> Iterator[Figure]:
    """Frames a second, and how the memory grows from 50 frames to 500."""
    yield from _rate(FRAMES)


def some() -> Iterator[Figure]:
    """Measure the same on fewer frames."""
    yield from _rate(SOME)


def _rate(frames: int) -> Iterator[Figure]:
    with TemporaryDirectory() as name:
        folder = Path(name)
        _draw(folder, SIDE, frames)
        sizes: list[float] = []
        seconds = work = 0.0
        for count in (BEFORE, frames):
            start, worked = time.perf_counter(), _cpu()
            pattern = "frames/f0[0-4]?.png" if count == BEFORE else "frames/*.png"
            sizes.append(_correlate(folder, pattern, f"out{count}"))
            seconds, work = time.perf_counter() - start, _cpu() - worked
        yield from line(
            TABLE,
            "500 frames of 5 MP, step 8, two cores",
            rate=(frames / seconds, "frames/s", at_least(3), frames),
            processor=(work / frames, "s a frame"),
            busy_with_us=(100 * work / seconds / (os.cpu_count() or 1), "% of the cores"),
            memory=(sizes[1], "MB"),
            memory_over_that_of_50_frames=(sizes[1] / sizes[0], "", at_most(1.1)),
        )


def killed() -> Iterator[Figure]:
    """Bytes that differ between a test that ran through and one that was killed three times."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        _draw(folder, SMALL, FEW)
        _correlate(folder, "frames/*.png", "whole")
        kills = 0
        while kills < KILLED:
            with subprocess.Popen(_command("frames/*.png", "again"), cwd=folder) as process:
                before = _parts(folder)
                while process.poll() is None and _parts(folder) < before + FEW // 6:
                    time.sleep(0.05)
                if process.poll() is None:
                    process.send_signal(signal.SIGKILL)
                    kills += 1
                else:
                    break
        _correlate(folder, "frames/*.png", "again")
        off = sum(
            _differ(*((folder / out / file).read_bytes() for out in ("whole", "again")))
            for file in ("fields.h5", "fields.xdmf")
        )
        yield from line(
            TABLE,
            f"500 frames of {SMALL}², killed three times and resumed",
            bytes_that_differ=(off, "", at_most(0), FEW),
            kills=kills,
        )


def _differ(one: bytes, other: bytes) -> int:
    """Count the bytes in which two files differ, those that only one has among them."""
    size = min(len(one), len(other))
    first, second = (np.frombuffer(data[:size], np.uint8) for data in (one, other))
    return int(np.count_nonzero(first != second)) + abs(len(one) - len(other))


def _parts(folder: Path) -> int:
    return len(list((folder / "again" / "parts").glob("*.npz")))


def _draw(folder: Path, side: int, frames: int) -> None:
    """Write a reference, six images that stretch, and their many names."""
    rng = np.random.default_rng(70)
    (folder / "images").mkdir()
    (folder / "frames").mkdir()
    Image.fromarray(eight_bit(speckle(side), NOISE, rng)).save(folder / "ref.png")
    for k in range(IMAGES):
        moved = speckle(side, (0.4 * k, -0.3 * k), (1 + 1e-3 * k, 1 - 3e-4 * k))
        path = folder / "images" / f"{k}.png"
        Image.fromarray(eight_bit(moved, NOISE, rng)).save(path, compress_level=1)
    for n in range(frames):
        (folder / "frames" / f"f{n:03d}.png").symlink_to(folder / "images" / f"{n % IMAGES}.png")


def _cpu() -> float:
    """CPU time of all commands run so far, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _command(frames: str, out: str) -> list[str]:
    program = "from rig.cli import main; main()"
    words = ["correlate", "ref.png", frames, "--step", str(STEP), "--out", out]
    return [sys.executable, "-c", program, *words]


def _correlate(folder: Path, frames: str, out: str) -> float:
    """Run the command to its end; the largest memory of any so far, MB."""
    subprocess.run(_command(frames, out), cwd=folder, check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e3


PARTS = {"rate": rate, "some": some, "killed": killed}

if __name__ == "__main__":
    run(PARTS, __doc__)

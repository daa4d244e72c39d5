"""Start-up: commands and packages, each in a process of its own.

Parts: commands, packages. Wall times; the median of five starts after one that fills the caches.
"""

import tempfile
from collections.abc import Callable, Iterator

import numpy as np
from PIL import Image

from rig.report.figure import Figure, judged
from rig.studies.correlation.images import eight_bit, speckle
from rig.studies.start import child
from rig.studies.study import line, run

REPEATS = 5


def commands() -> Iterator[Figure]:
    """Time `--help`, `show`, `correlate` and `doctor`."""
    with tempfile.TemporaryDirectory() as folder:
        pair = [f"{folder}/{name}.png" for name in ("before", "after")]
        for path, shift in zip(pair, ((0.0, 0.0), (0.4, 0.2)), strict=True):
            Image.fromarray(eight_bit(speckle(512, shift))).save(path)
        for name, most, *words in (
            ("touchplate --help", 0.3, "--help"),
            ("touchplate show twin", 1.0, "show", "twin"),
            ("touchplate show paper-one", 1.0, "show", "paper-one"),
            ("touchplate correlate, 512²", 2.0, "correlate", *pair, "--out", folder, "--force"),
            ("touchplate doctor", 1.0, "doctor"),
        ):
            time, *rest = told("Start of a command", name, lambda w=words: child.command(*w))
            yield judged(time, float(time.value), most, f"≤ {most:g} s")
            yield from rest


def packages() -> Iterator[Figure]:
    """Time the import of each package alone."""
    for package in ("dic", "fe", "synthetic", "models", "rig"):
        yield from told("Import of a package", package, lambda p=package: child.importing(p))


def told(table: str, name: str, start: Callable[[], child.Seen]) -> Iterator[Figure]:
    """Median time of some starts, memory, and the heavy modules that came in."""
    seen = [start() for _ in range(1 + REPEATS)][1:]
    return line(
        table,
        name,
        time=(f"{np.median([s.seconds for s in seen]):.2f}", "s"),
        memory=(f"{seen[0].memory:.0f}", "MB"),
        heavy_modules=", ".join(seen[0].modules) or "none",
    )


PARTS = {"commands": commands, "packages": packages}

if __name__ == "__main__":
    run(PARTS, __doc__)

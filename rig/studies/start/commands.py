"""Start-up: commands and packages, each in a process of its own.

Parts: commands, packages. Wall times; the median of five starts after one that fills the caches.
Modules are *needless* that are heavy and that neither the command nor the package works with.
"""

import tempfile
from collections.abc import Callable, Iterator, Set
from functools import partial

import numpy as np
from PIL import Image

from rig.report.figure import Bar, Figure, at_most
from rig.studies.correlation.images import eight_bit, speckle
from rig.studies.start import child
from rig.studies.study import line, run

REPEATS = 5
NONE_NEEDLESS = at_most(0)
PACKAGES = ("dic", "fe", "synthetic", "models", "rig")
CORRELATES = frozenset(("numba", "scipy", "cv2", "h5py", "pydantic"))


def commands() -> Iterator[Figure]:
    """Time `--help`, `show`, `correlate` and `doctor`."""
    with tempfile.TemporaryDirectory() as folder:
        pair = [f"{folder}/{name}.png" for name in ("before", "after")]
        for path, shift in zip(pair, ((0.0, 0.0), (0.4, 0.2)), strict=True):
            Image.fromarray(eight_bit(speckle(512, shift))).save(path)
        two = *pair, "--out", folder, "--force"
        starts: tuple[tuple[str, float, Set[str], tuple[str, ...]], ...] = (
            ("touchplate --help", 0.3, frozenset(), ("--help",)),
            ("touchplate show twin", 1.0, {"pydantic"}, ("show", "twin")),
            ("touchplate show paper-one", 1.0, {"pydantic"}, ("show", "paper-one")),
            ("touchplate correlate, 512²", 2.0, CORRELATES, ("correlate", *two)),
            ("touchplate doctor", 1.0, {"pydantic", "usb"}, ("doctor",)),
        )
        for name, limit, needed, words in starts:
            start = partial(child.command, *words)
            yield from started("Start of a command", name, start, needed, at_most(limit))


def packages() -> Iterator[Figure]:
    """Time the import of each package alone."""
    for package in PACKAGES:
        start = partial(child.importing, package)
        yield from started("Import of a package", package, start, frozenset(), None)


def started(
    table: str,
    name: str,
    start: Callable[[], child.Seen],
    needed: frozenset[str] | set[str],
    bar: Bar | None,
) -> Iterator[Figure]:
    """Median time of some starts, memory, and the heavy modules that came in."""
    seen = [start() for _ in range(1 + REPEATS)][1:]
    modules = seen[0].modules
    return line(
        table,
        name,
        time=(float(np.median([s.seconds for s in seen])), "s", bar, REPEATS),
        memory=(seen[0].memory, "MB"),
        heavy_modules=", ".join(modules) or "none",
        needless=(len(set(modules) - needed), "modules", NONE_NEEDLESS),
    )


PARTS = {"commands": commands, "packages": packages}

if __name__ == "__main__":
    run(PARTS, __doc__)

"""The bench on an emulated camera and display: speed, the closed loop, the page, presses, faults.

Parts: frame, presses, page, loop, faults. They need what the tests of the rig need (Xvfb, Chromium,
umockdev), and take half an hour.
"""

from collections.abc import Iterable, Iterator

from rig.live.tracker import LATENCY
from rig.report.figure import Figure
from rig.studies.bench import closed_loop, faults as wrong, page as seen
from rig.studies.chain import frame as live
from rig.studies.study import line, run
from rig.studies.touches import presses as pressed

MINUTES = 10.0
FRAMES = 200


def frame() -> Iterator[Figure]:
    """Time from capture to touches, with the error, by what is estimated from."""
    rest, frames = live.photograph(FRAMES)
    for way in live.WAYS:
        watch, scores, tiles = live.run(way, rest, frames, live.WALL)
        middle, late = watch.quantiles(LATENCY)
        yield from line(
            "From capture to touches, 1024², one touch",
            f"{way}, {tiles} tiles",
            median=(f"{middle:.1f}", "ms"),
            p95=(f"{late:.1f}", "ms"),
            place=(f"{scores['position_median_mm']:.2f}", "mm, median"),
            force=(f"{scores['force_median_percent']:.1f}", "%, median"),
            misses_and_false=f"{scores['misses']} and {scores['false_touches']} in {FRAMES}",
        )


def presses() -> Iterator[Figure]:
    """Mend a wrong model by 20 known presses."""
    for name, cells in pressed.rows(4, 120):
        yield from line("Twenty known presses on a bench that is not as its model", name, **cells)


def page() -> Iterator[Figure]:
    """Draw the page in a browser."""
    return told("The page at 1024² in headless Chromium", seen.rows(20.0, 1024))


def loop() -> Iterator[Figure]:
    """Light touches and see their light again."""
    title = f"The closed loop, {MINUTES:g} minutes, calibrated by itself"
    return told(title, closed_loop.rows(MINUTES, 1024, live=True))


def faults() -> Iterator[Figure]:
    """Let everything go wrong once."""
    for row in wrong.rows(wrong.SIZE):
        yield from line(
            "Faults",
            row.fault,
            what_the_user_sees=row.sees,
            back=row.back,
            false_touches=row.false,
        )


def told(title: str, rows: Iterable[tuple[str, str]]) -> Iterator[Figure]:
    """Make a table of rows."""
    for what, value in rows:
        yield Figure(title, what, "measured", value)


PARTS = {"frame": frame, "presses": presses, "page": page, "loop": loop, "faults": faults}

if __name__ == "__main__":
    run(PARTS, __doc__)

"""Correlate a whole test: every frame with one reference, on all cores, gone on after a kill.

Each frame is searched for by itself, so that its fields do not depend on which frames came before,
and a test that was killed ends in the same bytes.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path

import dic
from rig.series.frames import Frames
from rig.series.measure import measure
from rig.series.parts import is_whole, missing_part, write_part
from rig.series.tabulate import StrainOptions, strained

Report = Callable[[int, int], None]


def correlate_frames(
    ref: dic.Reference,
    frames: Frames,
    parts: Path,
    strain: StrainOptions,
    workers: int | None = None,
    report: Report = lambda done, total: None,
) -> None:
    """Write the part of every frame that has none yet.

    A frame that cannot be read or does not fit the reference leaves a sentence in its part.
    """
    total = len(frames.names)
    missing = [n for n in range(total) if not is_whole(parts, n)]
    report(total - len(missing), total)

    def one(number: int) -> None:
        try:
            found = measure(ref, frames.read(number), strain.field)
        except (OSError, ValueError) as error:
            write_part(parts, number, missing_part(strain.fields, len(ref.xy)), str(error))
            return
        write_part(parts, number, strained(found, strain).table(strain.fields), "")

    count = workers or os.cpu_count() or 1
    with ThreadPoolExecutor(count) as pool:
        for done, _ in enumerate(_in_turn(pool, one, missing, 2 * count), total - len(missing)):
            report(done + 1, total)


def _in_turn(
    pool: ThreadPoolExecutor, work: Callable[[int], None], numbers: Iterable[int], ahead: int
) -> Iterator[None]:
    """Do work, a few numbers ahead at a time; an unexpected error ends it."""
    waiting: set[Future[None]] = set()
    try:
        for number in numbers:
            waiting.add(pool.submit(work, number))
            if len(waiting) >= ahead:
                done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                for one in done:
                    yield one.result()
        for one in waiting:
            yield one.result()
    finally:
        for one in waiting:
            one.cancel()

"""Work that two cores do side by side."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from fe.arrays import I64

Given = TypeVar("Given")
Found = TypeVar("Found")

PARTS = 8
"""Parts of a stretch of work, after each of which it says a word of progress."""

# Factors, solves and products leave the interpreter, so that threads do; the glue between them does
# not, and more than two wait for it.
_WORKERS = 2


def in_parallel(work: Callable[[Given], Found], given: Iterable[Given]) -> Iterator[Found]:
    """Do some work on each of what is given, and yield what comes of it in that order."""
    workers = min(_WORKERS, os.cpu_count() or 1)
    with ThreadPoolExecutor(workers, "plate") as pool:
        try:
            yield from pool.map(work, given)
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def in_parts(count: int) -> list[I64]:
    """Divide so many things into `PARTS`, some of which are empty where they are few."""
    return np.array_split(np.arange(count), PARTS)


@dataclass
class Steps:
    """Steps of a long computation that are done, reported one by one.

    Attributes
    ----------
    report : callable or None
        Called with the steps done and their number.
    total : int
    done : int
    """

    report: Callable[[int, int], object] | None
    total: int
    done: int = 0

    def one(self) -> None:
        """Count one more."""
        self.done += 1
        if self.report is not None:
            self.report(self.done, self.total)

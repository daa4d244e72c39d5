"""The loader of the image net: pairs are made a step ahead, and taken again in later steps."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Generator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Generic, TypeVar

Group = TypeVar("Group")

AGAIN = (0, 5, 17, 43)
"""Steps after which a group of pairs is taken again: to render one costs what several steps do."""


class Loader(Generic[Group]):
    """Groups of pairs by number, each made once while it is needed, one ahead of the step.

    A group depends on its number alone, so a run that goes on takes what it would have taken.
    """

    def __init__(self, make: Callable[[int], Group], thread: ThreadPoolExecutor) -> None:
        self._make, self._thread = make, thread
        self._made: OrderedDict[int, Future[Group]] = OrderedDict()

    def batch(self, step: int) -> list[Group]:
        """Return the groups of a step, and begin to make the next one."""
        numbers = [step - lag for lag in AGAIN if step >= lag]
        for number in (*sorted(numbers), step + 1):
            if number not in self._made:
                self._made[number] = self._thread.submit(self._make, number)
        found = [self._made[number].result() for number in numbers]
        for number in [number for number in self._made if number < step - AGAIN[-1]]:
            del self._made[number]
        return found


@contextmanager
def loader(make: Callable[[int], Group]) -> Generator[Loader[Group]]:
    """Make groups in a thread of its own, which ends with the context."""
    thread = ThreadPoolExecutor(1, "image net loader")
    try:
        yield Loader(make, thread)
    finally:
        thread.shutdown(cancel_futures=True)

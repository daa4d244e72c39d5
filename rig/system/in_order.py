"""Work on all cores whose results are taken in turn."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

Result = TypeVar("Result")


def in_order(
    work: Callable[[int], Result], numbers: Iterable[int], workers: int
) -> Iterator[Result]:
    """Do work for numbers, a few ahead at a time; an error of it ends all that is not begun.

    Parameters
    ----------
    work : callable
        What it raises is raised here.
    numbers : iterable of int
    workers : int
        Threads; of twice as many numbers the results may wait.
    """
    waiting: deque[Future[Result]] = deque()
    with ThreadPoolExecutor(workers) as pool:
        try:
            for number in numbers:
                waiting.append(pool.submit(work, number))
                if len(waiting) >= 2 * workers:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for one in waiting:
                one.cancel()

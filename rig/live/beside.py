"""Work beside the loop, which no frame waits for and which ends no run."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

LOG = logging.getLogger("touchplate")
T = TypeVar("T")


def beside(name: str, make: Callable[[], T]) -> Future[T]:
    """Work something out in a thread of its own, which has the name."""
    worker = ThreadPoolExecutor(1, name)
    made = worker.submit(make)
    worker.shutdown(wait=False)
    return made


def failure(name: str, made: Future[T]) -> str:
    """Wait for work, and say why it has no result; empty where it has one.

    An error that nobody expects, all but `ValueError`, is logged with its traceback.
    """
    error = made.exception()
    if error is None or isinstance(error, ValueError):
        return str(error or "")
    LOG.error("%s failed (%r); frames go on", name, error, exc_info=error)
    return f"unexpected {type(error).__name__}: {error}"

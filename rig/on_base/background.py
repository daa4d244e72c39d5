"""Work in the background, which no frame waits for."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Protocol


class Background(Protocol):
    """Has something worked out."""

    def __call__(self, work: Callable[[], Any]) -> Future[Any]:
        """Begin, and give what will hold the result."""
        ...


def in_a_thread(work: Callable[[], Any]) -> Future[Any]:
    """Work in a thread that the end of the program does not wait for."""
    result: Future[Any] = Future()

    def run() -> None:
        try:
            result.set_result(work())
        except Exception as error:  # noqa: BLE001 - raised where the result is taken
            result.set_exception(error)

    threading.Thread(target=run, name="background", daemon=True).start()
    return result

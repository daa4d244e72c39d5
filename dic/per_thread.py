"""Arrays to work in: made once a thread for each size, and used again for all frames."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

Made = TypeVar("Made")


class PerThread(threading.local, Generic[Made]):
    """What a function makes of sizes, kept for each thread.

    Parameters
    ----------
    make : callable
        From sizes to arrays whose content does not outlast a call.
    """

    def __init__(self, make: Callable[..., Made]) -> None:
        self._make = make
        self._kept: dict[tuple[Hashable, ...], Made] = {}

    def __call__(self, *sizes: Hashable) -> Made:
        """Return the arrays of this thread for some sizes."""
        if sizes not in self._kept:
            self._kept[sizes] = self._make(*sizes)
        return self._kept[sizes]

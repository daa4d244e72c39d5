"""What has come since the last time: a snapshot has all that stands, another program the new."""

from __future__ import annotations

from typing import Generic, TypeVar

T = TypeVar("T")


class Newcomers(Generic[T]):
    """Call it with what stands in each frame: gives what did not in the one before, in order."""

    def __init__(self) -> None:
        self._last: tuple[T, ...] = ()

    def __call__(self, standing: tuple[T, ...]) -> tuple[T, ...]:
        """Give what is new."""
        last, self._last = self._last, standing
        return tuple(one for one in standing if one not in last)

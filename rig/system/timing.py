"""How long each stage of the loop takes: median and 95th percentile of the last frames."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator
from contextlib import contextmanager

import numpy as np

KEPT = 300  # frames


class Stopwatch:
    """Durations by stage, on a clock that the caller gives."""

    def __init__(self, clock: Callable[[], float], kept: int = KEPT):
        self._clock = clock
        self._kept = kept
        self._durations: dict[str, deque[float]] = {}

    @contextmanager
    def stage(self, name: str) -> Generator[None]:
        """Time what happens inside."""
        start = self._clock()
        yield
        self.add(name, self._clock() - start)

    def add(self, name: str, seconds: float) -> None:
        """Note a duration that was measured elsewhere."""
        self._durations.setdefault(name, deque(maxlen=self._kept)).append(seconds)

    def quantiles(self, name: str) -> tuple[float, float]:
        """Median and 95th percentile of a stage, ms; NaN where nothing was timed."""
        noted = self._durations.get(name)
        if not noted:
            return float("nan"), float("nan")
        median, late = 1e3 * np.percentile(noted, [50, 95])
        return float(median), float(late)

    def table(self) -> tuple[tuple[str, float, float], ...]:
        """Name, median and 95th percentile (ms) of each stage, in the order of first use."""
        return tuple((name, *self.quantiles(name)) for name in self._durations)

"""Fields of a result for who looks at them again and again: kept in memory.

A page that is dragged over a field asks for the same frames many times, and each is compressed in
the file.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import replace
from threading import Lock
from typing import Any

import numpy as np

from dic import export
from rig.series.invariants import Invariant, derived
from rig.series.read import SeriesResult
from rig.system.arrays import AnyArray

BUDGET = 256 << 20  # bytes of fields that are kept


class Kept:
    """The arrays that were read last, as many as the budget holds."""

    def __init__(self, budget: int = BUDGET) -> None:
        self._left, self._lock = budget, Lock()
        self._arrays: OrderedDict[tuple[str, int], AnyArray] = OrderedDict()

    def get(self, name: str, number: int) -> AnyArray | None:
        """Return an array, if it is kept."""
        with self._lock:
            found = self._arrays.get((name, number))
            if found is not None:
                self._arrays.move_to_end((name, number))
            return found

    def put(self, name: str, number: int, values: AnyArray) -> None:
        """Keep an array, and drop those that were not asked for longest."""
        with self._lock:
            if (name, number) in self._arrays:
                return
            self._arrays[name, number] = values
            self._left -= values.nbytes
            while self._left < 0:
                self._left += self._arrays.popitem(last=False)[1].nbytes


class _KeptField:
    """A field, read once."""

    def __init__(self, name: str, source: Any, kept: Kept) -> None:
        self.name, self.attrs = name, {"unit": export.unit_of(name)} | dict(source.attrs)
        self._source, self._kept = source, kept

    def __getitem__(self, number: int) -> AnyArray:
        found = self._kept.get(self.name, number)
        if found is None:
            found = np.asarray(self._source[number])
            self._kept.put(self.name, number, found)
        return found


def for_looking(result: SeriesResult, kept: Kept | None = None) -> SeriesResult:
    """Give a result whose fields are kept when they were read."""
    kept = kept or Kept()
    stored = {
        name: _KeptField(name, source, kept)
        for name, source in result.arrays.items()
        if not isinstance(source, Invariant)
    }
    following = {name: _KeptField(name, one, kept) for name, one in derived(stored).items()}
    arrays: dict[str, Any] = stored | following
    return replace(result, arrays=arrays)

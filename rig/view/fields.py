"""Fields of a result for who looks at them again and again: kept in memory, invariants beside them.

A page that is dragged over a field asks for the same frames many times, and each is compressed in
the file.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import replace
from threading import Lock
from typing import Any

import numpy as np

import dic
from dic import export
from rig.series.read import SeriesResult
from rig.system.arrays import AnyArray, Mask

BUDGET = 256 << 20  # bytes of fields that are kept
_STRAINS = ("exx", "eyy", "exy")
_DEPENDENT = (*export.INVARIANTS, *(f"sigma_{name}" for name in export.INVARIANTS))


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
    """A field of the file, read once."""

    def __init__(self, name: str, source: Any, kept: Kept) -> None:
        self.name, self.attrs = name, {"unit": export.unit_of(name)} | dict(source.attrs)
        self._source, self._kept = source, kept

    def __getitem__(self, number: int) -> AnyArray:
        found = self._kept.get(self.name, number)
        if found is None:
            found = np.asarray(self._source[number])
            self._kept.put(self.name, number, found)
        return found


class _Invariant:
    """A field that follows from the strain and its σ."""

    def __init__(self, name: str, strain: tuple[_KeptField, ...], kept: Kept) -> None:
        self.name, self.attrs = name, {"unit": export.unit_of(name)}
        self._strain, self._kept = strain, kept

    def __getitem__(self, number: int) -> AnyArray:
        found = self._kept.get(self.name, number)
        if found is not None:
            return found
        parts = [one[number] for one in self._strain]
        for name, values in _invariants(parts).items():
            self._kept.put(name, number, values)
            found = values if name == self.name else found
        if found is None:
            raise KeyError(self.name)
        return found


def for_looking(result: SeriesResult, kept: Kept | None = None) -> SeriesResult:
    """Give a result whose fields are kept when they were read, and that has the invariants too."""
    kept = kept or Kept()
    arrays: dict[str, Any] = {
        name: _KeptField(name, source, kept) for name, source in result.arrays.items()
    }
    needed = (*_STRAINS, *(f"sigma_{name}" for name in _STRAINS))
    more = [] if export.INVARIANTS[0] in arrays else list(_DEPENDENT)
    strain = tuple(arrays[name] for name in needed if name in arrays)
    if len(strain) < len(needed):
        more = []
    arrays |= {name: _Invariant(name, strain, kept) for name in more}
    stored = tuple(name for name in result.fields if name != "status")
    return replace(result, arrays=arrays, fields=(*stored, *more, "status"))


def _invariants(parts: list[AnyArray]) -> dict[str, AnyArray]:
    """Invariants of exx, eyy, exy and their σ, (R, C) each, float32 by name."""
    shape = parts[0].shape
    flat = np.array([part.ravel() for part in parts], dtype=np.float64)
    points = np.zeros((flat.shape[1], 2))
    valid: Mask = np.all(np.isfinite(flat[:3]), axis=0)
    exx, eyy, exy = flat[:3]
    eps = dic.StrainField(points, exx, eyy, exy, flat[3:].T, valid, 0, 1, "small", None)
    found = export.invariant_columns(eps)
    return {name: values.reshape(shape).astype(np.float32) for name, values in found.items()}

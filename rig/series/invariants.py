"""Invariants of strain: those of a file that does not hold them follow from what it holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

import dic
from dic import export
from rig.system.arrays import F64, AnyArray, Mask

STRAINS = ("exx", "eyy", "exy")
_NEEDED = (*STRAINS, *(f"sigma_{name}" for name in STRAINS))


def invariants_of(strain: F64, sigma: F64) -> dict[str, F64]:
    """Invariants of exx, eyy, exy (3, N) and of their σ (3, N), and σ of each, (N,) by name."""
    exx, eyy, exy = strain
    valid: Mask = np.all(np.isfinite(strain), axis=0)
    points = np.zeros((len(exx), 2))
    eps = dic.StrainField(points, exx, eyy, exy, sigma.T, valid, 0, 1, "small", None)
    return export.invariant_columns(eps)


class Invariant:
    """A field that follows from strain and σ; it is read as one of the file, frame by frame."""

    def __init__(self, name: str, frames: _Frames) -> None:
        self.name, self.attrs = name, {"unit": export.unit_of(name)}
        self._frames = frames

    def __getitem__(self, number: int) -> AnyArray:
        return self._frames.invariants(number)[self.name]


class _Frames:
    """The invariants of the frame that was read last: all ten come in one."""

    def __init__(self, sources: tuple[Any, ...]) -> None:
        self._sources = sources
        self._last: tuple[int, dict[str, AnyArray]] = -1, {}

    def invariants(self, number: int) -> dict[str, AnyArray]:
        """Return them by name, (R, C) float32 each."""
        last = self._last
        if last[0] != number:
            last = self._last = number, self._read(number)
        return last[1]

    def _read(self, number: int) -> dict[str, AnyArray]:
        parts = [np.asarray(one[number], dtype=np.float64) for one in self._sources]
        strain, sigma = np.array(parts).reshape(2, len(STRAINS), -1)
        found = invariants_of(strain, sigma)
        return {n: values.reshape(parts[0].shape).astype(np.float32) for n, values in found.items()}


def derived(arrays: Mapping[str, Any]) -> dict[str, Invariant]:
    """Return the invariants that fields by name lack; none where they lack the strain too."""
    if export.INVARIANTS[0] in arrays or not set(_NEEDED) <= set(arrays):
        return {}
    frames = _Frames(tuple(arrays[name] for name in _NEEDED))
    spread = (f"sigma_{name}" for name in export.INVARIANTS)
    return {name: Invariant(name, frames) for name in (*export.INVARIANTS, *spread)}

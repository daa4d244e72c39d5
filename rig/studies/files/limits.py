"""Between which numbers any bench lies; written from benches, not from the program's checks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf, isfinite
from typing import Any, cast

ANY = (-1e9, 1e9)
LIMITS: Mapping[str, tuple[float, float]] = {
    "width": (1e-6, 1e6),
    "height": (1e-6, 1e6),
    "grams": (1e-9, 1e6),
    "ruler": (10, 1000),
    "thickness": (1e-6, 1e5),
    "young": (1e-6, 1e8),
    "poisson": (-1, 0.5),
    "stand_off": (1e-6, 1e6),
    "rate": (1e-4, 1e5),
    "diameter": (1e-6, 1e6),
    "density": (0, 1),
    "contrast": (0, 1),
    "softness": (0, 1),
    "noise": (0, 65535),
    "radius": (0, 1e6),
    "margin": (0, 1e6),
    "spacing": (1e-6, 1e6),
    "port": (0, 65535),
    "pixels": (1, 1e5),
    "subset": (1, 1e4),
    "tile": (1, 1e4),
    "seed": (0, 1e12),
    "test_seed": (0, 1e12),
    "epochs": (1, 1e12),
    "samples": (1, 1e12),
    "test_samples": (1, 1e12),
    "exposure": (1e-9, 1e6),
    "focal": (1e-6, 1e8),
    "sigma_focal": (0, 1e9),
    "gain": (1e-9, 1e4),
    "read": (0, 65535),
    "median": (0, 60),
    "p95": (0, 60),
    "error": (0, 1e9),
    "error_force": (0, 1e9),
    "residual": (0, 1e9),
    "strength": (0, 1e5),
    "sigma_gain": (0, 1e9),
    "discrepancy": (0, 1),
    "memory": (0, 1),
    "prior": (0, 1e9),
    "points": (-1e5, 1e5),
    "start": (-1e5, 1e5),
    "end": (-1e5, 1e5),
}
"""Smallest and largest by the name of the key; of all others `ANY`."""

SIDES = ("size", "force")
"""More than nothing, wherever they stand."""

RIGID = ("deflection", "rotation", "membrane")
"""Of an edge; without limit where it is rigid."""


def out_of_range(table: Any, name: str = "") -> Iterator[str]:
    """Name every number of a nested table that no bench has."""
    match table:
        case Mapping():
            for key, value in cast("Mapping[str, Any]", table).items():
                yield from out_of_range(value, key)
        case str() | bool() | None:
            pass
        case Sequence():
            for value in cast("Sequence[Any]", table):
                yield from out_of_range(value, name)
        case int() | float() if not _possible(name, float(table)):
            yield f"{name} = {table}"
        case _:
            pass


def _possible(name: str, value: float) -> bool:
    if name in RIGID:
        return value == inf or 0 <= value <= 1e13
    low, high = LIMITS.get(name, (1e-9, 1e9) if name in SIDES else ANY)
    return isfinite(value) and low <= value <= high

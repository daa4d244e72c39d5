"""What a plate on a bench may have that its description does not say: 54 numbers, 0 if nothing.

ln young and ln thickness scale the whole plate; the thickness may differ over it, as products of
Legendre polynomials up to the sixth degree; the plate may be in tension and not flat while nothing
presses; each edge may give in rotation and in the plane, by the same everywhere or by more at one
end.
"""

from __future__ import annotations

import numpy as np

from fe.arrays import F64

SIDES = ("west", "east", "south", "north")
SHAPES = ("sag", "sag_x", "sag_y", "sag_xx", "sag_xy", "sag_yy")
DEGREES = tuple((degree - k, k) for degree in range(1, 7) for k in range(degree + 1))
"""Degrees in x and in y of each thickness that differs over the plate."""
THICKNESSES = tuple("thickness_" + "x" * i + "y" * j for i, j in DEGREES)
TENSIONS = ("tension_xx", "tension_yy", "tension_xy")


def _edges(kind: str, unit: str) -> tuple[tuple[str, str], ...]:
    return tuple((f"{kind}_{side}{end}", unit) for side in SIDES for end in ("", "_slope"))


BENCH_PARAMETERS: tuple[tuple[str, str], ...] = (
    ("young", "1"),
    ("thickness", "1"),
    *((name, "1") for name in THICKNESSES),
    *((name, "N/mm") for name in TENSIONS),
    *((name, "mm") for name in SHAPES),
    *_edges("rotation", "1/N"),
    *_edges("membrane", "mm²/N"),
)
"""Name and unit of every number, in the order of all arrays of them; "1" stands for a natural
logarithm or a fraction."""

NAMES = tuple(name for name, _ in BENCH_PARAMETERS)

YOUNG, THICKNESS = 0, 1
GRADED = slice(2, 29)
TENSION = slice(29, 32)
SHAPE = slice(32, 38)
ROTATION = slice(38, 46)
MEMBRANE = slice(46, 54)


def bench_values(**given: float) -> F64:
    """Numbers (54,) of a bench from those that are not 0, by name.

    Raises
    ------
    ValueError
        A name is none of `NAMES`.
    """
    values = np.zeros(len(NAMES))
    for name, value in given.items():
        if name not in NAMES:
            raise ValueError(f"no bench has a {name!r}; use one of {', '.join(NAMES)}")
        values[NAMES.index(name)] = value
    return values

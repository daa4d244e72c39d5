"""Rendering and estimation at their ends; `table` runs them."""

from collections.abc import Iterator
from itertools import groupby

from rig.report.figure import Figure, at_most
from rig.studies.rendering.exactness import DISPLACEMENTS, point_error
from rig.studies.stiff.case import case
from rig.studies.touches import extremes

PIXELS = at_most(1e-5)


def rendering() -> Iterator[Figure]:
    """Find the material point of every pixel of a plate that moves far."""
    for name, motion in DISPLACEMENTS.items():
        yield from case(f"rendering, {name}", "inverse map", point_error(motion), "px", PIXELS)


def estimation() -> Iterator[Figure]:
    """Press with forces over six decades, at edges, two as one, and in single precision.

    "Doubted" are answers whose result or p-value says that they are not to be believed.
    """
    for part in extremes.SOME.values():
        for (table, name), figures in groupby(part(), lambda figure: figure.place[:2]):
            first, *others = figures
            if first.bar is None or not isinstance(first.value, int | float):
                raise ValueError(f"{name} must begin with its bar, got {first.quantity}")
            unit = f"{first.unit}, {first.quantity}"
            seen = ", ".join(f"{each.quantity} {each.text}" for each in others if each.value)
            reason = table.removeprefix("Extremes: ")
            yield from case(f"solver, {name}", reason, first.value, unit, first.bar, seen=seen)

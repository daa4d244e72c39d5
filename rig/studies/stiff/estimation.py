"""Rendering and estimation at their ends; `study_stiff.py` runs them."""

from collections.abc import Iterator

from rig.report.figure import Figure
from rig.studies.rendering.exactness import DISPLACEMENTS, point_error
from rig.studies.stiff.case import case
from rig.studies.touches import extremes as solver_extremes

SHARE = 0.25  # of the scenes of solver_extremes.py
PIXELS = 1e-5


def rendering() -> Iterator[Figure]:
    """Find the material point of every pixel of a plate that moves far."""
    for name, motion in DISPLACEMENTS.items():
        error = point_error(motion)
        bar, met = f"≤ {PIXELS:g} px", bool(error <= PIXELS)
        yield from case(f"rendering, {name}", "inverse map", f"{error:.0e} px", bar=bar, met=met)


def estimation() -> Iterator[Figure]:
    """Press with forces over six decades, at edges, two as one, and in single precision.

    "Told" are answers whose result or p-value says that they are not to be believed.
    """
    for part in solver_extremes.PARTS.values():
        reason = part.heading.removeprefix("Extremes: ")
        for what, figure, bar in part.rows(SHARE):
            met = "wrong" not in figure
            yield from case(f"solver, {what}", reason, figure, bar=bar, met=met)

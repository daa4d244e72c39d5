"""Whether a plate is thin enough for Kirchhoff's theory, which knows no shear."""

from __future__ import annotations

from math import inf

from fe.plate.plate import Plate

THICK = 0.05
"""Thickness over the shortest held span from which on plates are refused; shear adds 3.6 %."""

# Correction of Reissner for the shear that is not even over the thickness.
_SHEAR_FACTOR = 5.0 / 6.0
# Deflection by shear under a touch over F / (κ G h). It grows with the logarithm of span over
# touch; fitted to the clamped square of h/a = 0.083 on brick elements, 10 % softer by shear.
_SHEAR_SPREAD = 0.28


def span(plate: Plate) -> float:
    """Shortest side of a plate along which an edge holds it, mm."""
    held = [
        side if any(edge.springs.deflection > 0 for edge in plate.sides.along(axis)) else inf
        for axis, side in enumerate(plate.size)
    ]
    return min(held)


def check_thin(plate: Plate) -> None:
    """Raise where shear makes a plate softer than Kirchhoff's theory knows.

    Patches may be thicker: what is much stiffer than the plate about it hardly bends.

    Raises
    ------
    ValueError
        The thickness is 0.05 of the shortest held span or more.
    """
    if plate.thickness >= THICK * span(plate):
        raise ValueError(
            f"plate thickness must stay below {THICK:g} of the span of its edges, "
            f"{THICK * span(plate):.4g} mm, got {plate.thickness:g} mm; thicker plates shear, "
            "which this theory leaves out: use solid elements"
        )


def shear_fraction(plate: Plate, force: float, deflection: float) -> float:
    """Estimate what shear adds to a deflection under a touch, in parts of it.

    Parameters
    ----------
    plate : Plate
    force : float, N
    deflection : float, mm
        Without shear, under the touch.
    """
    modulus = plate.young / (2.0 * (1.0 + plate.poisson))
    sheared = _SHEAR_SPREAD * force / (_SHEAR_FACTOR * modulus * plate.thickness)
    return sheared / deflection

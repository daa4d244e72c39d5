"""Why a bench that presses seem to show is none: a list, a plate or an image that is another's.

A descent always ends somewhere. Presses of another plate, or a list with columns swapped, end in
numbers that no bench has, in presses that nothing agrees on, or nowhere.
"""

from __future__ import annotations

from math import isfinite

import numpy as np

import models
from rig.system.arrays import F64

_FAR = 0.1  # of the shorter side: no bench that works sees touches so far from where they are
_FORCE = 0.5  # of a force, by which held-out presses may err
_OFF = 5.0  # of the prior's standard deviations, by which a number may differ from the scene
_WIDE = 1.5  # of them, up to which presses may leave a number less sure than it was
_STIFFNESS = ("young", "thickness")
_NAMES = tuple(name for name, _ in models.BENCH)
_KEPT = "the calibration stays as it was"


def require_places(places: F64, seen: F64, size: tuple[float, float]) -> None:
    """Refuse a list whose places are not those at which the images show touches.

    Parameters
    ----------
    places : (N, 2) float64, mm
        Of the list.
    seen : (N, 2) float64, mm
        As the bench that is described shows them, wherever the list has them.
    size : (float, float), mm
        Sides of the plate.

    Raises
    ------
    ValueError
        If most places lie elsewhere.
    """
    limit = _FAR * min(size)
    if not len(places) or (away := _median_away(places, seen)) <= limit:
        return
    a, b = size
    otherwise = {
        "with x_mm and y_mm swapped": places[:, ::-1],
        "with x_mm counted from the other edge": (a, 0.0) + (-1.0, 1.0) * places,
        "with y_mm counted from the other edge": (0.0, b) + (1.0, -1.0) * places,
        "with both counted from the other edge": (a, b) - places,
    }
    fitting = [said for said, other in otherwise.items() if _median_away(other, seen) <= limit]
    hint = f"; {fitting[0]} they agree" if len(fitting) == 1 else ""
    raise ValueError(
        f"half of the listed places are {away:.0f} mm or more from where the images show the"
        f" touches{hint}; correct the list, or plate.size in the scene: {_KEPT}"
    )


def _median_away(places: F64, seen: F64) -> float:
    return float(np.median(np.hypot(*(places - seen).T)))


class UnsoundBenchError(ValueError):
    """Presses show a bench that cannot be."""


def require_sound(bench: models.BenchEstimate, size: tuple[float, float]) -> None:
    """Refuse a bench that cannot be: one that did not converge, or of numbers that no bench has.

    Parameters
    ----------
    bench : BenchEstimate
        From presses.
    size : (float, float), mm
        Sides of the plate.

    Raises
    ------
    UnsoundBenchError
        With the number that is wrong, and what may be its cause.
    """
    shown = bench.shown or bench  # a number that nobody asked for may be as wrong
    reason = _number(shown) or _presses(bench, size) or _certainty(shown)
    if reason is not None:
        raise UnsoundBenchError(f"{reason}: {_KEPT}")


def _number(bench: models.BenchEstimate) -> str | None:
    """Say which number lies beyond what a bench can have."""
    off = np.abs(bench.values) / np.where(bench.prior > 0, bench.prior, np.inf)
    worst = int(np.argmax(off))
    if off[worst] <= _OFF:
        return None
    name, unit = models.BENCH[worst]
    said = f"{name} = {bench.values[worst]:.3g} {unit}".removesuffix(" 1")
    remedy = "plate.size and the places of the list"
    if name in _STIFFNESS:
        remedy = "plate.thickness, plate.young and the forces of the list, in N"
    if name in bench.measured:
        return (
            f"the presses show a camera with {said}, {off[worst]:.0f} times as far from where the"
            " board had it as it may be; calibrate lens and pose again, or check the places of the"
            " list"
        )
    return (
        f"the presses show a bench with {said}, {off[worst]:.0f} times as far from the scene as is"
        f" usual; check {remedy}"
    )


def _presses(bench: models.BenchEstimate, size: tuple[float, float]) -> str | None:
    """Say how presses contradict each other, or the bench that all others show."""
    count, held = len(bench.touches), bench.held_out
    if 2 * len(bench.outliers) > count:
        return (
            f"{len(bench.outliers)} of {count} presses contradict the others; check the places and"
            " forces of the list, and that its frames are those of the presses"
        )
    if held is not None and held.place > _FAR * min(size):
        return (
            f"held-out presses are found {held.place:.0f} mm from their places; check plate.size"
            " and the places of the list"
        )
    if held is not None and isfinite(held.force) and held.force > _FORCE:
        return (
            f"the forces of the list contradict each other: held-out ones are wrong by"
            f" {held.force:.0%}; check them, in N"
        )
    return None


def _certainty(bench: models.BenchEstimate) -> str | None:
    """Say whether the descent ended nowhere, or made a number less sure than it was."""
    if not (bench.converged and bench.is_sound):
        return (
            "the search for the bench did not converge; check that plate, camera and list are those"
            " of the images, and press at nine places or more"
        )
    offset = np.zeros(len(_NAMES))
    offset[[_NAMES.index("shift_x"), _NAMES.index("shift_y")]] = bench.label_offset
    sigma = np.sqrt(np.maximum(bench.sigma**2 - offset**2, 0.0))  # that is said by itself
    wide = sigma / np.where(bench.prior > 0, bench.prior, np.inf)
    worst = int(np.argmax(wide))
    if wide[worst] <= _WIDE:
        return None
    return (
        f"the presses leave {_NAMES[worst]} {wide[worst]:.1f} times as uncertain as before them;"
        " check the places and forces of the list, and press at more places"
    )

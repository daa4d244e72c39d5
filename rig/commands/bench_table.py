"""What presses tell of a bench, as a table and as data."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from rich.table import Table

    import models

_PLACE, _FORCE = 3.0, 0.1  # mm and fraction by which a list may scatter before that is said
_FEW = 9  # presses that determine most numbers
_REACH = 0.4  # of a side, which presses that are spread over a plate cover


def described(
    bench: models.BenchEstimate, presses: list[str], size: tuple[float, float]
) -> dict[str, Any]:
    """Return every number with its prior, value, σ and whether the presses determine it.

    Parameters
    ----------
    bench : BenchEstimate
    presses : list of str
        Their names.
    size : (float, float), mm
        Sides of the plate.
    """
    from models import BENCH, otherwise

    rows = zip(BENCH, bench.prior, bench.values, bench.sigma, bench.known, strict=True)
    held, (place, force) = bench.held_out, bench.label_sigma
    return {
        "parameters": [
            {
                "name": name,
                "unit": unit,
                "prior_sigma": float(prior),
                "value": float(value),
                "sigma": float(sigma),
                "determined": bool(known),
            }
            for (name, unit), prior, value, sigma, known in rows
        ],
        "discrepancy": bench.discrepancy,
        "memory": bench.memory,
        "fixed_pattern_grey_levels": sqrt(bench.fixed_pattern[0]),
        "held_out": None
        if held is None
        else {
            "place_mm": held.place,
            "force_fraction": _finite(held.force),
            "presses": held.count,
        },
        "converged": bench.converged,
        "outliers": [presses[index] for index in bench.outliers],
        "label_offset_mm": list(bench.label_offset),
        "label_sigma": {"place_mm": _finite(place), "force_fraction": _finite(force)},
        "otherwise": [one._asdict() for one in otherwise(bench)],
        "cautions": list(_cautions(bench, presses, size)),
    }


def _errors(said: dict[str, Any]) -> str:
    """Write an error of places and one of forces, where they are known."""
    place, force = said["place_mm"], said["force_fraction"]
    parts = ["" if place is None else f"{place:.2f} mm"]
    parts.append("" if force is None else f"force {force:.1%}")
    return ", ".join(part for part in parts if part)


def _finite(number: float) -> float | None:
    return number if isfinite(number) else None


def table(said: dict[str, Any]) -> Table:
    """Draw the table of what `described` gave."""
    from rich.table import Table

    held = said["held_out"]
    title = f"bench, in {said['path']}"
    if held:
        title += f"; held-out presses {_errors(held)}"
    if any(said["label_sigma"].values()):
        title += f"; σ of the list {_errors(said['label_sigma'])}"
    drawn = Table("number", "unit", "prior σ", "value", "σ", "determined", title=title)
    for row in said["parameters"]:
        numbers = (f"{row[name]:.3g}" for name in ("prior_sigma", "value", "sigma"))
        drawn.add_row(row["name"], row["unit"], *numbers, "yes" if row["determined"] else "no")
    drawn.caption = "; ".join(said["cautions"]) or None
    return drawn


def _cautions(
    bench: models.BenchEstimate, presses: list[str], size: tuple[float, float]
) -> Iterator[str]:
    """Say what of the presses makes the bench less sure than it might be."""
    from models import otherwise

    if bench.outliers:
        named = ", ".join(presses[index] for index in bench.outliers)
        yield f"do not agree with the others, and are not among the held-out: press {named}"
    place, force = bench.label_sigma
    if place > _PLACE:
        yield f"the listed places scatter by {place:.1f} mm about those that the presses show"
    if force > _FORCE:
        yield f"the listed forces contradict each other: they scatter by {force:.0%}"
    if variance := bench.fixed_pattern[0]:
        yield (
            f"the sensor has a fixed pattern of {sqrt(variance):.1f} grey levels, which is taken"
            " out; clean it and calibrate again"
        )
    if len(presses) < _FEW:
        yield (
            f"{len(presses)} presses leave most numbers as uncertain as before; press at {_FEW}"
            " places or more"
        )
    for axis, side, reach in zip("xy", size, np.ptp(bench.touches[:, :2], axis=0), strict=True):
        if reach < _REACH * side:
            yield (
                f"the presses cover {reach:.0f} mm of {side:.0f} mm along {axis}; spread them over"
                " the plate"
            )
    if also := otherwise(bench):
        named = ", ".join(one.sentence for one in also)
        yield (
            f"not as described either, and not asked for: {named}; these stay as uncertain as"
            " before, and all numbers with them: name them with --free too, or leave it out"
        )
    if any(bench.label_offset):
        x, y = bench.label_offset
        yield (
            f"the listed places lie {x:+.2f} mm along x and {y:+.2f} mm along y of those that the"
            " presses show, and σ is wider by it; check where the list begins to count"
        )

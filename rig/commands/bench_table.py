"""What presses tell of a bench, as a table and as data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.table import Table

    import models


def described(bench: models.BenchEstimate, presses: list[str]) -> dict[str, Any]:
    """Return every number with its prior, value, σ and whether the presses determine it."""
    from models import BENCH

    rows = zip(BENCH, bench.prior, bench.values, bench.sigma, bench.known, strict=True)
    held = bench.held_out
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
        "held_out": None
        if held is None
        else {"place_mm": held.place, "force_fraction": held.force, "presses": held.count},
        "converged": bench.converged,
        "outliers": [presses[index] for index in bench.outliers],
        "label_offset_mm": list(bench.label_offset),
    }


def table(said: dict[str, Any]) -> Table:
    """Draw the table of what `described` gave."""
    from rich.table import Table

    held = said["held_out"]
    title = f"bench, in {said['path']}"
    if held:
        title += f"; held-out presses {held['place_mm']:.2f} mm, force {held['force_fraction']:.1%}"
    drawn = Table("number", "unit", "prior σ", "value", "σ", "determined", title=title)
    for row in said["parameters"]:
        numbers = (f"{row[name]:.3g}" for name in ("prior_sigma", "value", "sigma"))
        drawn.add_row(row["name"], row["unit"], *numbers, "yes" if row["determined"] else "no")
    cautions: list[str] = []
    if not said["converged"]:
        cautions.append(
            "the descent did not end by itself: these numbers are not yet the likeliest"
        )
    if said["outliers"]:
        cautions.append(f"do not agree with the others: press {', '.join(said['outliers'])}")
    if any(said["label_offset_mm"]):
        x, y = said["label_offset_mm"]
        cautions.append(
            f"the listed places lie {x:+.2f} mm along x and {y:+.2f} mm along y of those that the"
            " presses show, and σ is wider by it; check where the list begins to count"
        )
    drawn.caption = "; ".join(cautions) or None
    return drawn

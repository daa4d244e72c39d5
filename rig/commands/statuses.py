"""What became of the points of a pair or of a whole test, in lines for people."""

from __future__ import annotations

from collections.abc import Mapping


def status_lines(points: int, status: Mapping[str, float]) -> list[str]:
    """Return the fraction of each status, by its name, and the sentence of each but OK."""
    from dic import Status

    here = {name: part for name, part in status.items() if part}
    fractions = ", ".join(f"{name} {part:.1%}" for name, part in here.items())
    sentences = [f"  {name}: {Status[name.upper()].sentence}" for name in here if name != "ok"]
    return [f"{points} points: {fractions}", *sentences]

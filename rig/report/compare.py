"""Two reports side by side: which figures changed, and which bars are no longer met."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from rig.report.figure import Figure, read

RAW = "raw"
TIMES = ("s", "ms")
"""Units of run times, which another day and another machine change: their ratios are compared."""


class Change(NamedTuple):
    """A figure of two reports.

    Attributes
    ----------
    study : str
    before, after : Figure
        Of one table, case and quantity.
    ratio : float
        After over before; NaN where one is not a number.
    """

    study: str
    before: Figure
    after: Figure
    ratio: float

    @property
    def lost(self) -> bool:
        """Whether a bar that was met is missed now."""
        return (self.before.verdict, self.after.verdict) == ("met", "missed")


def changes(before: Path, after: Path, least: float) -> list[Change]:
    """Return the figures that differ by a share of `least` or more, and the bars lost.

    Run times are left out; a study states the ratios that should stay.

    Raises
    ------
    OSError
        If one of the folders holds no report.
    """
    old, new = _figures(before), _figures(after)
    found = []
    for place in old.keys() & new.keys():
        change = Change(place[0], old[place], new[place], _ratio(old[place], new[place]))
        timed = change.after.unit in TIMES
        if change.lost or (abs(change.ratio - 1) >= least and not timed):
            found.append(change)
    return sorted(found, key=lambda change: (not change.lost, change.study, change.after))


def _figures(report: Path) -> dict[tuple[str, ...], Figure]:
    files = sorted((report / RAW).glob("*.csv"))
    if not files:
        raise OSError(
            f"'{report}' holds no report; build one with touchplate report --out {report}"
        )
    return {(file.stem, *figure[:3]): figure for file in files for figure in read(file)}


def _ratio(before: Figure, after: Figure) -> float:
    try:
        return float(after.value) / float(before.value)
    except (ValueError, ZeroDivisionError):
        return float("nan")

"""Two reports side by side: which figures changed, and which bars were lost or eased."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rig.report.figure import Figure, read

RAW = "raw"
TIMES = ("s", "ms", "CPU s")
"""Units of run times, which another day and another machine change: their ratios are compared."""

Kind = Literal["lost", "eased", "changed"]
KINDS: tuple[Kind, ...] = ("lost", "eased", "changed")


Kept = dict[str, dict[tuple[str, str, str], Figure]]
"""Figures of studies by name, and by table, case and quantity."""


@dataclass(frozen=True)
class Change:
    """A figure of two reports.

    Attributes
    ----------
    study : str
    kind : {"lost", "eased", "changed"}
        A bar that was there is missed now, not measured or gone; it asks for less; or the value
        differs.
    before : Figure
    after : Figure or None
        Of the same table, case and quantity; None where there is none any more.
    """

    study: str
    kind: Kind
    before: Figure
    after: Figure | None

    @property
    def now(self) -> str:
        """What is there now, as it is to be read."""
        return "gone" if self.after is None else self.after.text


def changes(old: Kept, new: Kept, fraction: float) -> list[Change]:
    """Return the bars that were lost or eased, and the figures that differ by `fraction` or more.

    What a study states that is in one report only is left out. Run times that have no bar are left
    out; a study states the ratios that should stay.
    """
    found = [
        Change(study, kind, figure, now)
        for study in old.keys() & new.keys()
        for place, figure in old[study].items()
        if (kind := _kind(figure, now := new[study].get(place), fraction))
    ]
    return sorted(found, key=lambda each: (KINDS.index(each.kind), each.study, each.before.place))


def _kind(before: Figure, after: Figure | None, fraction: float) -> Kind | None:
    if before.bar is not None:
        if after is None or after.bar is None or (before.verdict, after.verdict) in LOSSES:
            return "lost"
        if after.bar.eases(before.bar):
            return "eased"
    if after is None or after.unit in TIMES:
        return None
    return "changed" if _differ(before.value, after.value, fraction) else None


LOSSES = {("met", "missed"), ("met", "not measured"), ("missed", "not measured")}
"""Verdicts before and after of a bar that is lost."""


def _differ(before: float | str | None, after: float | str | None, fraction: float) -> bool:
    """Whether two numbers differ by a fraction; words may."""
    if not isinstance(before, float) or not isinstance(after, float):
        return False
    return abs(after - before) >= fraction * abs(before) and after != before


def kept_figures(report: Path) -> Kept:
    """Read the figures of each study that was run or tried.

    Raises
    ------
    OSError
        If the folder holds no report.
    """
    raw = report / RAW
    names = {file.stem for file in raw.glob("*.json")} | {file.stem for file in raw.glob("*.csv")}
    if not names:
        raise OSError(
            f"'{report}' holds no report; build one with touchplate report --out {report}"
        )
    return {name: {figure.place: figure for figure in read(raw / f"{name}.csv")} for name in names}

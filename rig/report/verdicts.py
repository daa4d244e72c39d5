"""Bars counted: how many were met, which were missed, which were not measured."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from rig.report.figure import Figure


class Verdicts(NamedTuple):
    """Figures that have a bar, by outcome."""

    met: tuple[Figure, ...]
    missed: tuple[Figure, ...]
    not_measured: tuple[Figure, ...]

    @property
    def any(self) -> bool:
        """Whether there is a bar at all."""
        return any(self)

    @property
    def sentence(self) -> str:
        """The count of each."""
        return (
            f"{len(self.met)} met, {len(self.missed)} missed, {len(self.not_measured)} not measured"
        )


def judged(figures: Iterable[Figure]) -> Verdicts:
    """Sort the figures that have a bar by their verdict."""
    found = tuple(figures)
    kinds = "met", "missed", "not measured"
    return Verdicts(*(tuple(f for f in found if f.verdict == kind) for kind in kinds))

"""Figures beside their bars: what each package is held to, in the report's table.

Parts: correlation, plates, strain, extremes, pattern, large. Each is what ``dic_bars.py``,
``plate_bars.py``, ``solver_bars.py``, ``solver_extremes.py`` and ``pattern_bars.py`` print.
"""

from collections.abc import Iterator, Mapping

from rig.report.figure import Figure
from rig.studies.correlation import bars as dic_bars
from rig.studies.plates import linear as plate_bars
from rig.studies.study import run
from rig.studies.touches import (
    extremes as solver_extremes,
    pattern as pattern_bars,
    rows as bars,
    strain as solver_bars,
)

LARGE = ("four", "two")
"""Parts of `pattern_bars` on a plate that large touches bend."""


def correlation() -> Iterator[Figure]:
    """Bias, scatter, failures, and speed beside peers, on rendered pictures."""
    for name, value, bar, met in dic_bars.rows():
        verdict = "" if met is None else "met" if met else "missed"
        yield Figure("Correlation", name, "measured", value, "", bar, verdict)


def plates() -> Iterator[Figure]:
    """Linear plates."""
    for row in plate_bars.rows():
        yield Figure("Linear plates", row.what, "measured", row.measured)
        yield Figure("Linear plates", row.what, "bar", row.bar)


def strain() -> Iterator[Figure]:
    """Touches from 72 strains."""
    return of_the_solver(solver_bars.PARTS)


def extremes() -> Iterator[Figure]:
    """Press at the ends of forces, places and numbers."""
    return of_the_solver(solver_extremes.PARTS)


def pattern() -> Iterator[Figure]:
    """Touches from the whole pattern, of linear theory."""
    parts = pattern_bars.PARTS.items()
    return of_the_solver({name: part for name, part in parts if name not in LARGE})


def large() -> Iterator[Figure]:
    """Touches from the whole pattern that bend the plate by more than its thickness."""
    return of_the_solver({name: pattern_bars.PARTS[name] for name in LARGE})


def of_the_solver(parts: Mapping[str, bars.Part]) -> Iterator[Figure]:
    """Make a table a heading."""
    for part in parts.values():
        for what, measured, bar in part.rows(1.0):
            yield Figure(part.heading, what, "measured", measured)
            yield Figure(part.heading, what, "bar", bar)


PARTS = {
    "correlation": correlation,
    "plates": plates,
    "strain": strain,
    "extremes": extremes,
    "pattern": pattern,
    "large": large,
}

if __name__ == "__main__":
    run(PARTS, __doc__)

"""One line of the table of stiff and extreme cases."""

from collections.abc import Callable, Iterator

from rig.report.figure import Bar, Figure, at_most
from rig.studies.study import line

TABLE = "Stiff and extreme cases"
RIGHT = "measured"
"""The column whose bar says whether the case is right."""
NOT_WRONG = at_most(0), "silently wrong"
"""Bar and unit of a case of which only counts how much of it is wrong without a word."""


def case(
    name: str, reason: str, value: float, unit: str, bar: Bar, *, seen: str = "", said: str = ""
) -> Iterator[Figure]:
    """Make the figures of one case.

    Parameters
    ----------
    name, reason : str
        The case, and what makes it hard.
    value, unit, bar
        What must be right of it; `tests/test_stiff.py` holds every case to it.
    seen : str
        What else is seen of its result.
    said : str
        What the user reads.
    """
    measured = {RIGHT: (value, unit, bar)}
    return line(TABLE, name, reason=reason, **measured, seen=seen, what_the_user_reads=said)


def refused(name: str, reason: str, act: Callable[[], object]) -> Iterator[Figure]:
    """Do what must be refused, and quote the sentence."""
    bar, unit = NOT_WRONG
    try:
        act()
    except (ValueError, OSError) as refusal:
        return case(name, reason, 0, unit, bar, seen="refused", said=str(refusal))
    return case(name, reason, 1, unit, bar, seen="accepted")

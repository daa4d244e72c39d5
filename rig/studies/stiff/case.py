"""One line of the table of stiff and extreme cases."""

from collections.abc import Callable, Iterator

from rig.report.figure import Figure
from rig.studies.study import line

TABLE = "Stiff and extreme cases"


def case(
    name: str, reason: str, right: str, said: str = "", *, bar: str, met: bool
) -> Iterator[Figure]:
    """Make the figures of one case.

    Parameters
    ----------
    name, reason : str
        The case, and what makes it hard.
    right : str
        What is right of its result.
    said : str
        What the user is told.
    bar : str
        What must be right of it; `tests/test_stiff.py` holds every case to it.
    met : bool
    """
    cells = line(TABLE, name, reason=reason, right=right, what_the_user_is_told=said)
    verdict = "met" if met else "missed"
    for cell in cells:
        yield cell._replace(bar=bar, verdict=verdict) if cell.quantity == "right" else cell


def refused(name: str, reason: str, act: Callable[[], object]) -> Iterator[Figure]:
    """Do what must be refused, and quote the sentence."""
    try:
        act()
    except (ValueError, OSError) as refusal:
        return case(name, reason, "refused", str(refusal), bar="refused", met=True)
    return case(name, reason, "taken", bar="refused", met=False)

"""One line of the table of stiff and extreme cases."""

from collections.abc import Iterator

from study import line

from rig.report.figure import Figure

TABLE = "Stiff and extreme cases"


def case(name: str, reason: str, right: str, said: str = "") -> Iterator[Figure]:
    """Make the figures of one case: what makes it hard, what is right, what the user is told."""
    return line(TABLE, name, reason=reason, right=right, what_the_user_is_told=said)

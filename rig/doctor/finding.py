"""One thing that was looked at."""

from dataclasses import dataclass
from enum import StrEnum


class FindingState(StrEnum):
    """How bad it is."""

    GOOD = "good"
    ABSENT = "absent"  # not there, and only some benches need it
    WRONG = "wrong"  # the bench will not run as it should


@dataclass(frozen=True)
class Finding:
    """What was found about a topic, and what to do where it is not good."""

    topic: str
    state: FindingState
    text: str
    remedy: str = ""


def good(topic: str, text: str) -> Finding:
    """Make a finding that needs nothing."""
    return Finding(topic, FindingState.GOOD, text)


def absent(topic: str, text: str, remedy: str = "") -> Finding:
    """Make a finding about what only some benches need."""
    return Finding(topic, FindingState.ABSENT, text, remedy)


def wrong(topic: str, text: str, remedy: str) -> Finding:
    """Make a finding that needs its remedy."""
    return Finding(topic, FindingState.WRONG, text, remedy)

"""How long a person takes at a page whose clicks a script does."""

ACTION = 5.0
"""Seconds of a person who must look and think, for each click, key and drag."""


def with_hands(seconds: float, actions: int) -> float:
    """Minutes of a machine that takes `seconds`, and of a person who acts so often."""
    return (seconds + ACTION * actions) / 60

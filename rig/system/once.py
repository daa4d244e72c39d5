"""Sentences about something that has gone wrong: each is said once, however often it is asked."""

from __future__ import annotations

from collections.abc import Callable


def says_once(trouble: Callable[[], str], say: Callable[[str], object]) -> Callable[[object], None]:
    """Return what asks for the sentence and says it where it is a new one; empty ones never are.

    Parameters
    ----------
    trouble : callable
        Gives the sentence, empty while all is well.
    say : callable
        Takes it.
    """
    said: set[str] = set()

    def look(_: object) -> None:
        sentence = trouble()
        if sentence and sentence not in said:
            said.add(sentence)
            say(sentence)

    return look

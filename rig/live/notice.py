"""A sentence for the user that stands for some seconds."""

from __future__ import annotations

SHOWN = 6.0  # s


class Notice:
    """What was done at the user's wish, or why nothing was."""

    def __init__(self) -> None:
        self.text = ""
        self._said: float | None = None

    def say(self, text: str) -> None:
        """Let a sentence stand from the next frame on."""
        if text != self.text:
            self.text, self._said = text, None

    def at(self, time: float) -> str:
        """Give the sentence for `SHOWN` seconds after it was first given; `time` is a capture's."""
        if self.text and self._said is None:
            self._said = time
        if self._said is None or time - self._said < SHOWN:
            return self.text
        self.text = ""
        return ""

"""The setup in a terminal: sentences out, and lines in from a thread that waits for them."""

from __future__ import annotations

import queue
import sys
import threading
from collections.abc import Callable, Iterator

from rig.page.setup_view import StepLine, StepView
from rig.setup.desk import Answer, Drop, Go, Leave, Push, Wish
from rig.system.frame import Frame

Lines = Callable[[], Iterator[str]]
"""Gives the lines that were typed since it was last called; None of them is waited for."""

HELP = "Enter goes on; a number answers a question, as in `3 = 1.5`; also: step NAME, drop N, leave"


class TerminalDesk:
    """See `Desk`.

    Parameters
    ----------
    say : callable
        Takes a sentence.
    lines : callable
        See `Lines`.
    """

    def __init__(self, say: Callable[[str], object], lines: Lines):
        self._say, self._lines = say, lines
        self._view: StepView | None = None
        self._said: tuple[object, ...] = ()
        self._listed: tuple[object, ...] = ()

    def enter(self, steps: tuple[StepLine, ...]) -> None:
        """See `Desk`."""
        marks = {"done": "x", "now": ">", "open": " ", "closed": " "}
        self._say("")
        self._say("  ".join(f"[{marks[one.state]}] {one.name}" for one in steps))
        self._view, self._said, self._listed = None, (), ()

    def show(self, view: StepView, frame: Frame | None) -> None:
        """See `Desk`; only what is new is said."""
        self._view = view
        taken = f" ({view.progress.taken} of {view.progress.wanted})" if view.progress else ""
        said = view.sentence, view.trouble, taken
        if said != self._said:
            self._said = said
            self._say(f"{view.title}: {view.sentence}{taken}")
            if view.trouble:
                self._say(f"  ! {view.trouble}")
        listed = view.questions, view.buttons, view.verdict, tuple(s.warns for s in view.signs)
        if listed != self._listed:
            self._listed = listed
            self._list(view)

    def _list(self, view: StepView) -> None:
        for number, one in enumerate(view.questions, start=1):
            choices = f"   of {' | '.join(one.choices)}" if one.choices else ""
            self._say(f"  {number}  {one.label}: {one.value}{choices}")
        for sign in view.signs:
            self._say(f"  {'!' if sign.warns else ' '} {sign.name}: {sign.says}")
        for row in view.verdict:
            advice = f"   ({row.advice})" if row.advice else ""
            self._say(f"  {' ' if row.good else '!'} {row.what}: {row.figure}{advice}")
        if view.buttons:
            names = (f"{one.name} ({one.label}{', Enter' * one.usual})" for one in view.buttons)
            self._say(f"  {'   '.join(names)}")
            self._say(f"  {HELP}")

    def wishes(self) -> Iterator[Wish]:
        """See `Desk`; one line at a time, so that each is replied to before the next."""
        line = next(self._lines(), None) if self._view else None
        if line is None:
            return
        if line.strip() == "help":
            self._say(f"  {HELP}")
        elif (wish := self._wish(line.strip())) is not None:
            yield wish
        else:
            self._say(f"  ! '{line.strip()}' is nothing that can be done here; {HELP}")

    def _wish(self, line: str) -> Wish | None:
        view = self._view
        if view is None:
            return None
        number, equals, text = (part.strip() for part in line.partition("="))
        if equals and number.isdecimal() and 1 <= int(number) <= len(view.questions):
            return self._answer(view, int(number), text)
        match line.split():
            case []:
                usual = next((one.name for one in view.buttons if one.usual), None)
                return Push(usual) if usual else None
            case ["leave"]:
                return Leave()
            case ["step", name]:
                return Go(name)
            case ["drop", view_number] if view_number.isdecimal():
                return Drop(int(view_number))
            case [name] if any(name == one.name for one in view.buttons):
                return Push(name)
            case _:
                return None

    def _answer(self, view: StepView, number: int, text: str) -> Answer:
        """Answer a question; a choice may be given by a part of it."""
        asked = view.questions[number - 1]
        near = [one for one in asked.choices if text and text.casefold() in one.casefold()]
        return Answer(asked.key, near[0] if len(near) == 1 else text)


def typed_lines() -> Lines:
    """Read lines in a thread, which does not hold the setup up; the end of input leaves."""
    waiting: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            waiting.put(line)
        waiting.put("leave")

    threading.Thread(target=read, name="terminal", daemon=True).start()

    def lines() -> Iterator[str]:
        while not waiting.empty():
            yield waiting.get()

    return lines

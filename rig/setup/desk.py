"""What the setup shows to a person, and what it hears from him."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

from rig.page.setup_view import StepLine, StepView
from rig.system.frame import Frame


@dataclass(frozen=True)
class Answer:
    """A question was answered, as text."""

    key: str
    text: str


@dataclass(frozen=True)
class Push:
    """A button was pressed."""

    button: str


@dataclass(frozen=True)
class Go:
    """Another step is wanted."""

    step: str


@dataclass(frozen=True)
class Drop:
    """A view is to be taken out."""

    view: int


@dataclass(frozen=True)
class Leave:
    """The person goes; the setup is resumed another day."""


@dataclass(frozen=True)
class Next:
    """The step is done."""


Wish = Answer | Push | Go | Drop | Leave
Outcome = Next | Go | Leave
"""How a step ends."""


class Desk(Protocol):
    """A page, a terminal, or a test."""

    def enter(self, steps: tuple[StepLine, ...]) -> None:
        """Take the list of all steps, when one is entered."""
        ...

    def show(self, view: StepView, frame: Frame | None) -> None:
        """Show a step as it stands, and what the camera sees."""
        ...

    def wishes(self) -> Iterator[Wish]:
        """Take what the person has wanted since this was last asked."""
        ...


WISHES = "answer", "press", "go", "drop", "leave"


def wish_of(asked: dict[str, Any]) -> Wish | None:
    """Read what a page asks for; None where that is nothing known."""
    match asked:
        case {"do": "answer", "key": str(key), "text": str(text)}:
            return Answer(key, text)
        case {"do": "press", "button": str(button)}:
            return Push(button)
        case {"do": "go", "step": str(step)}:
            return Go(step)
        case {"do": "drop", "view": int(view)}:
            return Drop(view)
        case {"do": "leave"}:
            return Leave()
        case _:
            return None

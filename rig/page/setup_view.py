"""What a step of the setup shows: a sentence, questions, figures, an image, buttons."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rig.calibration.guide import Progress
from rig.live.snapshot import Sign


@dataclass(frozen=True)
class Question:
    """A question, how it was answered, and what is wrong with that.

    Attributes
    ----------
    key, label, value : str
    choices : tuple of str
        What may be answered; empty where anything may be written.
    free : bool
        Whether something else may be written too.
    """

    key: str
    label: str
    value: str
    choices: tuple[str, ...] = ()
    free: bool = False


@dataclass(frozen=True)
class Button:
    """Something that can be done, and whether Enter does it."""

    name: str
    label: str
    usual: bool = False


@dataclass(frozen=True)
class StepLine:
    """A step in the list of all, and what it has measured, with its unit."""

    name: str
    title: str
    state: Literal["done", "now", "open", "closed"]
    figure: str = ""


@dataclass(frozen=True)
class VerdictRow:
    """A figure of the bench, whether it is good, and what would make it better."""

    what: str
    figure: str
    good: bool
    advice: str


@dataclass(frozen=True)
class StepView:
    """A step as it stands.

    Attributes
    ----------
    name, title, sentence : str
        Of the step; what is to be done now.
    trouble : str
        What is wrong, a sentence; empty where nothing is.
    questions : tuple of Question
    buttons : tuple of Button
    progress : Progress or None
        Of a calibration under way, whose error is in `unit`.
    signs : tuple of Sign
        Figures of the image.
    histogram : tuple of int
        Pixels by grey level, from dark to bright; empty where it is not shown.
    mark : (x, y) or None, px
        Where to press, in the image.
    verdict : tuple of VerdictRow
    """

    name: str
    title: str
    sentence: str
    trouble: str = ""
    questions: tuple[Question, ...] = ()
    buttons: tuple[Button, ...] = ()
    progress: Progress | None = None
    unit: str = "mm"
    signs: tuple[Sign, ...] = ()
    histogram: tuple[int, ...] = ()
    mark: tuple[float, float] | None = None
    verdict: tuple[VerdictRow, ...] = ()

"""The steps from nothing to a calibrated bench, and what has to be done again after which."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rig.setup.answers import Answers

StepName = Literal[
    "plate", "print", "camera", "output", "latency", "lens", "pose", "projector", "noise",
    "presses", "verdict",
]  # fmt: skip


@dataclass(frozen=True)
class Step:
    """One step.

    Attributes
    ----------
    name : StepName
    title : str
    says : str
        What is to be done, for the user.
    after : tuple of StepName
        Steps that it stands on: once one of them is done anew, so must this be.
    lit : bool
        Whether only a bench with a projector has it.
    begins : {"at once", "free plate", "on demand"}
        What a guide waits for: nothing, a plate on which nothing lies or moves, or the person.
    """

    name: StepName
    title: str
    says: str
    after: tuple[StepName, ...] = ()
    lit: bool = False
    begins: Literal["at once", "free plate", "on demand"] = "at once"


STEPS = (
    Step("plate", "Plate", "describe the plate and what looks at it"),
    Step(
        "print",
        "Print",
        "print the board and the speckle at 100 %, hold a ruler to the board's, glue the speckle"
        " to the plate and the board to something flat",
        ("plate",),
    ),
    Step(
        "camera",
        "Camera",
        "choose the camera, look at the plate, and set focus, light and exposure",
        ("plate",),
    ),
    Step("output", "Projector", "choose the output that is the projector", ("plate",), lit=True),
    Step(
        "latency",
        "Delay of the light",
        "leave the plate alone while the projector flashes",
        ("camera", "output"),
        lit=True,
    ),
    Step(
        "lens",
        "Lens",
        "hold the board before the camera, tilted to all sides; views are taken by themselves",
        ("camera", "print"),
    ),
    Step(
        "pose",
        "Place of the plate",
        "lay the board on the plate, measure its edges from the plate's, and let go",
        ("lens",),
        begins="on demand",
    ),
    Step(
        "projector",
        "Light on the plate",
        "take the board away and darken the room a little; stripes will be projected",
        ("pose", "output"),
        lit=True,
        begins="free plate",
    ),
    Step(
        "noise",
        "Noise",
        "leave plate and camera alone, and change the light when asked",
        ("camera",),
    ),
    Step(
        "presses",
        "Known weight",
        "take your hands off the plate; then lay the weight on each mark, on a foot of some mm",
        ("pose",),
    ),
    Step("verdict", "Verdict", "what the bench is good for, and what to improve", ("presses",)),
)


def steps_of(answers: Answers) -> tuple[Step, ...]:
    """Return the steps of a bench, in order."""
    return tuple(step for step in STEPS if answers.projector == "yes" or not step.lit)


def next_step(answers: Answers, done: tuple[StepName, ...]) -> Step | None:
    """Return the first step that is not done; None after the last."""
    return next((step for step in steps_of(answers) if step.name not in done), None)


def can_enter(answers: Answers, done: tuple[StepName, ...], name: str) -> bool:
    """Whether all that a step stands on is done."""
    there = {step.name: step for step in steps_of(answers)}
    if name not in there:
        return False
    return all(other in done for other in there[there[name].name].after if other in there)


def after(done: tuple[StepName, ...], name: StepName) -> tuple[StepName, ...]:
    """Return what is done once a step was done anew: all that stood on it is no longer."""
    stale = _standing_on(name)
    return (*(one for one in done if one != name and one not in stale), name)


def _standing_on(name: StepName) -> set[StepName]:
    stale: set[StepName] = set()
    for step in STEPS:  # in order: what a step stands on comes before it
        if {name, *stale} & set(step.after):
            stale.add(step.name)
    return stale

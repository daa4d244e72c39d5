"""The step of the projector: which output of the desktop it is."""

from __future__ import annotations

import time
from dataclasses import dataclass
from math import inf

from rig.page.setup_view import Button, Question, StepView
from rig.projector.outputs import Output
from rig.setup.answers import Answers
from rig.setup.desk import Answer, Go, Leave, Next, Outcome, Push, Wish
from rig.setup.forms import IDLE, LABELS, LATER
from rig.setup.session import SetupSession
from rig.setup.steps import Step

LISTED = 3.0  # s before the desktop is asked again what it has


def choose_projector(setup: SetupSession, step: Step) -> Outcome:
    """Let the output that is likely flash, or another, and take it once the person agrees."""
    choice = _Choice(setup, step)
    while True:
        wishes = tuple(setup.desk.wishes())
        choice.look(anew=bool(wishes))
        for wish in wishes:
            if (outcome := choice.hear(wish)) is not None:
                return outcome
        if choice.chosen is not None and not (choice.flashed or choice.trouble):
            choice.flash(choice.chosen)
        setup.desk.show(choice.view(), None)
        time.sleep(IDLE)


@dataclass
class _Choice:
    """An output that is chosen, whether it has flashed, and those that are there."""

    setup: SetupSession
    step: Step
    chosen: Output | None = None
    flashed: bool = False
    trouble: str = ""
    there: tuple[Output, ...] = ()
    failure: str = ""
    listed: float = -inf

    def look(self, anew: bool) -> None:
        """List what the desktop has, at once if `anew`; one that is gone is no longer chosen."""
        if anew or time.monotonic() - self.listed > LISTED:
            (self.there, self.failure), self.listed = _outputs(self.setup), time.monotonic()
        if self.chosen is not None and self.chosen not in self.there:
            gone = f"output {self.chosen} is not there any more"
            self.trouble = f"{gone}; plug it in again, or choose another"
            self.chosen, self.flashed = None, False
        self.chosen = self.chosen or _as_answered(self.there, self.setup.state.answers)

    def hear(self, wish: Wish) -> Outcome | None:
        """Do what the person wants; gives how the step ends, if it does."""
        match wish:
            case Answer("output", text):
                self.chosen = next((one for one in self.there if str(one) == text), None)
                missing = f"output '{text}' is not there; choose another"
                self.flashed, self.trouble = False, "" if self.chosen else missing
            case Push("flash"):
                self.flashed, self.trouble = False, ""
            case Push("next") if self.chosen and self.flashed:
                self.trouble = _keep_output(self.setup, self.chosen, self.there)
                return None if self.trouble else Next()
            case Go() | Leave():
                return wish
            case _:
                pass
        return None

    def flash(self, output: Output) -> None:
        """Let an output flash, and say before where to look."""
        moment = StepView(self.step.name, self.step.title, f"look: output {output} flashes")
        self.setup.desk.show(moment, None)
        self.trouble = _flash(self.setup, output)
        self.flashed = not self.trouble

    def view(self) -> StepView:
        step, listed = self.step, tuple(map(str, self.there))
        asked = Question("output", LABELS["output"], str(self.chosen or ""), listed)
        yes = (Button("next", "Yes, it is the projector", usual=True),) if self.flashed else ()
        label = "Let it flash again" if self.flashed else "Let it flash"
        flash = (Button("flash", label, usual=not self.flashed),) if self.chosen else ()
        says = "did this screen flash? then it is the projector" if self.flashed else step.says
        trouble, buttons = self.trouble or self.failure, (*flash, *yes, LATER)
        return StepView(step.name, step.title, says, trouble, (asked,), buttons)


def _outputs(setup: SetupSession) -> tuple[tuple[Output, ...], str]:
    try:
        return setup.bench.outputs(), ""
    except OSError as error:
        return (), str(error)


def _as_answered(there: tuple[Output, ...], answers: Answers) -> Output | None:
    """Output that was chosen before, or the last one, which is rarely the laptop's own."""
    wanted = answers.output
    known = (one for one in there if wanted in (one.index, one.name))
    return next(known, there[-1] if there and wanted is None else None)


def _flash(setup: SetupSession, output: Output) -> str:
    try:
        setup.bench.flash(output)
    except OSError as error:
        return str(error)
    return ""


def _keep_output(setup: SetupSession, chosen: Output, there: tuple[Output, ...]) -> str:
    """Write an output by its name where that is its own, by its number elsewhere."""
    same = [one for one in there if one.name.casefold() == chosen.name.casefold()]
    named = chosen.name if chosen.name and len(same) == 1 else chosen.index
    said = {"output": named, "screen": chosen.size}
    setup.keep(setup.state.with_answers(setup.state.answers.model_copy(update=said)))
    return setup.write_scene()

"""The step of the projector: which output of the desktop it is."""

from __future__ import annotations

import time

from rig.page.setup_view import Button, Question, StepView
from rig.projector.outputs import Output
from rig.setup.answers import Answers
from rig.setup.desk import Answer, Go, Leave, Next, Outcome, Push
from rig.setup.forms import IDLE, LABELS, LATER
from rig.setup.session import SetupSession
from rig.setup.steps import Step

LISTED = 3.0  # s before the desktop is asked again what it has


def choose_projector(setup: SetupSession, step: Step) -> Outcome:
    """Let an output flash, and take the one that is the projector."""
    chosen: Output | None = None
    says, trouble = step.says, ""
    flashed, (there, failure), listed = False, _outputs(setup), time.monotonic()
    while True:
        wishes = tuple(setup.desk.wishes())
        if wishes or time.monotonic() - listed > LISTED:
            (there, failure), listed = _outputs(setup), time.monotonic()
        if chosen is not None and chosen not in there:
            trouble = f"output {chosen} is not there any more; plug it in again, or choose another"
            chosen, flashed = None, False
        chosen = chosen or _as_answered(there, setup.state.answers)
        for wish in wishes:
            match wish:
                case Answer("output", text):
                    chosen = next((one for one in there if str(one) == text), None)
                    flashed, says = False, step.says
                    trouble = "" if chosen else f"output '{text}' is not there; choose another"
                case Push("flash") if chosen:
                    trouble = _flash(setup, chosen)
                    flashed, says = not trouble, "does this screen flash? then it is the projector"
                case Push("next") if chosen and flashed:
                    trouble = _keep_output(setup, chosen, there)
                    if not trouble:
                        return Next()
                case Go() | Leave():
                    return wish
                case _:
                    pass
        asked = Question(
            "output", LABELS["output"], str(chosen or ""), tuple(str(one) for one in there)
        )
        yes = (Button("next", "Yes, it is the projector", usual=True),) if flashed else ()
        again = (Button("flash", "Let it flash", usual=not flashed),) if chosen else ()
        view = StepView(
            step.name, step.title, says, trouble or failure, (asked,), (*again, *yes, LATER)
        )
        setup.desk.show(view, None)
        time.sleep(IDLE)


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

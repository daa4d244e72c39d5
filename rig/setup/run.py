"""Leads from step to step until the bench is calibrated, or the person leaves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rig.page.setup_view import StepLine
from rig.setup.bench import SetupBench
from rig.setup.choose_camera import choose_camera
from rig.setup.choose_projector import choose_projector
from rig.setup.desk import Desk, Go, Leave, Next, Outcome
from rig.setup.figures import rows_of
from rig.setup.forms import ask_plate, ask_prints
from rig.setup.guided_steps import be_guided
from rig.setup.known_weight import press_known_weight
from rig.setup.session import SetupSession, SetupState, resume_state
from rig.setup.steps import Step, StepName, can_enter, next_step, steps_of
from rig.setup.verdict import give_verdict

WORK: dict[StepName, Callable[[SetupSession, Step], Outcome]] = {
    "plate": ask_plate,
    "print": ask_prints,
    "camera": choose_camera,
    "output": choose_projector,
    "presses": press_known_weight,
    "verdict": give_verdict,
}
"""What does each step; a guide leads through the others."""


def set_up(path: Path, bench: SetupBench, desk: Desk) -> bool:
    """Set a bench up, from the first step that is not done.

    Parameters
    ----------
    path : Path
        Of the scene, which is written beside what is measured and how far it is.
    bench : SetupBench
    desk : Desk

    Returns
    -------
    bool
        Whether all steps are done; else they can be resumed.

    Raises
    ------
    OSError, ValueError
        If a file of an earlier time cannot be read, is damaged, or is a rehearsal's where this is
        none, or the other way round.
    """
    setup = SetupSession(path, bench, desk, resume_state(path, bench.rehearsal))
    _ = setup.calibration  # a damaged one is refused before anything is asked
    step = next_step(setup.state.answers, setup.state.done)
    while step is not None:
        desk.enter(_lines(setup, step))
        if "plate" in setup.state.done:
            bench.prepare(setup.state.answers)
        match WORK.get(step.name, be_guided)(setup, step):
            case Next():
                setup.keep(setup.state.after(step.name))
                step = next_step(setup.state.answers, setup.state.done)
            case Go(name):
                step = _entered(setup.state, name) or step
            case Leave():
                return False
    return True


def _entered(state: SetupState, name: str) -> Step | None:
    """Return a step that may be entered now."""
    if not can_enter(state.answers, state.done, name):
        return None
    return next(step for step in steps_of(state.answers) if step.name == name)


def _lines(setup: SetupSession, now: Step) -> tuple[StepLine, ...]:
    return tuple(_line(setup, step, now) for step in steps_of(setup.state.answers))


def _line(setup: SetupSession, step: Step, now: Step) -> StepLine:
    state = setup.state
    if step == now:
        return StepLine(step.name, step.title, "now")
    if step.name in state.done:
        figures = (row.figure for row in rows_of(step.name, setup.calibration, state.answers))
        return StepLine(step.name, step.title, "done", next(figures, ""))
    free = can_enter(state.answers, state.done, step.name)
    return StepLine(step.name, step.title, "open" if free else "closed")

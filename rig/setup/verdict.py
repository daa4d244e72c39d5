"""What a bench is good for, in mm and N, and what would make it better."""

from __future__ import annotations

import time

import numpy as np

from rig.calibration.store import Calibration
from rig.design.outlook import Outlook, outlook
from rig.page.setup_view import Button, StepView, VerdictRow
from rig.scene import Scene
from rig.scene.load import with_overrides
from rig.setup.answers import Answers
from rig.setup.desk import Go, Leave, Next, Outcome, Push
from rig.setup.figures import PLACE, measured_rows
from rig.setup.forms import IDLE, LATER
from rig.setup.session import SetupSession
from rig.setup.steps import Step

MIDDLE_GREY = 128.0  # grey levels
HELPS = 2  # changes that are named
FINISH = Button("next", "Finish", usual=True)


def give_verdict(setup: SetupSession, step: Step) -> Outcome:
    """Say what was reached, until the person has read it."""
    measured = measured_rows(setup.calibration, setup.state.answers)
    moment = "one moment: what noise leaves, and what would help, is computed"
    setup.desk.show(StepView(step.name, step.title, moment, verdict=measured), None)
    predicted, trouble = _predicted(setup)
    rows = (*measured, *predicted)
    good = sum(row.good for row in rows)
    says = f"{good} of {len(rows)} figures are good; run it with: touchplate run {setup.path}"
    if setup.bench.rehearsal:
        says = f"{good} of {len(rows)} figures are good; this was a rehearsal on the twin"
    view = StepView(step.name, step.title, says, trouble, (), (FINISH, LATER), verdict=rows)
    while True:
        for wish in setup.desk.wishes():
            match wish:
                case Push("next"):
                    return Next()
                case Go() | Leave():
                    return wish
                case _:
                    pass
        setup.desk.show(view, None)
        time.sleep(IDLE)


def _predicted(setup: SetupSession) -> tuple[tuple[VerdictRow, ...], str]:
    """Figures that the model of the bench says, and why they could not be had."""
    scene = setup.scene
    try:
        made = outlook(as_measured(scene, setup.calibration))
    except ValueError as error:
        return (), str(error)
    return (noise_row(made, setup.state.answers), theory_row(made, scene)), ""


def as_measured(scene: Scene, known: Calibration) -> Scene:
    """Return a scene with the noise that its camera has at middle grey."""
    noise = known.noise
    if noise is None:
        return scene
    black = known.projector.black if known.projector else 0.0
    variance = noise.read**2 + noise.gain * (MIDDLE_GREY - black)
    return with_overrides(scene, {"sensor.noise": float(np.sqrt(max(variance, 0.0)))})


def noise_row(made: Outlook, answers: Answers) -> VerdictRow:
    """Say what noise alone leaves of the known weight in one frame, and what would help most."""
    place = float(np.median(made.errors.place)) / answers.weight
    force = float(np.median(made.errors.force))
    helps = "; ".join(
        f"{one.what} {one.before} → {one.after}: better by {100 * (one.gain - 1):.0f} %"
        for one in made.changes[:HELPS]
    )
    return VerdictRow(
        f"noise of a frame at {answers.weight:.1f} N",
        f"{place:.2g} mm, {force:.2g} N",
        place <= PLACE,
        helps,
    )


def theory_row(made: Outlook, scene: Scene) -> VerdictRow:
    """Say up to which force the plate is linear."""
    wanted = scene.touches.force[1] if scene.touches else 0.0
    good = made.linear_to >= wanted
    advice = "" if good else "the theory of large touches is taken, which is slower to start"
    return VerdictRow("linear up to", f"{made.linear_to:.2g} N", good, advice)

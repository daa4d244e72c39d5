"""What a bench is good for, in mm and N, and what would make it better."""

from __future__ import annotations

import time

import numpy as np

from rig.calibration.store import Calibration
from rig.design.outlook import Design, design
from rig.page.setup_view import Button, StepView, VerdictRow
from rig.scene import Scene
from rig.scene.load import with_overrides
from rig.setup.answers import Answers
from rig.setup.desk import Go, Leave, Next, Outcome, Push
from rig.setup.forms import IDLE, LATER
from rig.setup.session import SetupSession
from rig.setup.steps import Step

PLATE, LIGHT = 0.15, 0.3  # mm: of plate and projector, as a rehearsal reaches them
NOISE, LATE = 4.0, 0.1  # grey levels, s
PLACE, FORCE = 1.0, 0.02  # mm, fraction: of a press of the known weight
MIDDLE_GREY = 128.0  # grey levels
HELPS = 2  # changes that are named
ADVICE = {
    "presses": "lay the weight on the marks more exactly, or set the camera nearer",
    "force": "weigh the weight, and look whether the clamps hold",
    "place of the plate": "find the lens anew with more tilted views, then the place",
    "light on the plate": "darken the room, focus the projector, and look for a bent plate",
    "noise in the dark": "more light and less gain",
    "light comes late by": "switch off what the projector does to images: game mode, keystone",
}
"""What to do where a figure is not good."""

FINISH = Button("next", "Finish", usual=True)


def give_verdict(setup: SetupSession, step: Step) -> Outcome:
    """Say what was reached, until the person has read it."""
    setup.desk.show(StepView(step.name, step.title, "one moment: the bench is judged"), None)
    rows, trouble = _rows(setup)
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


def _rows(setup: SetupSession) -> tuple[tuple[VerdictRow, ...], str]:
    """Figures of the bench, and why some could not be had."""
    scene, known, answers = setup.scene, setup.calibration, setup.state.answers
    rows = measured_rows(known, answers)
    try:
        made = design(as_measured(scene, known), lambda done, total, note="": None)
    except ValueError as error:
        return rows, str(error)
    return (*rows, noise_row(made, answers), theory_row(made, scene)), ""


def as_measured(scene: Scene, known: Calibration) -> Scene:
    """Return a scene with the noise that its camera has at middle grey."""
    noise = known.noise
    if noise is None:
        return scene
    black = known.projector.black if known.projector else 0.0
    variance = noise.read**2 + noise.gain * (MIDDLE_GREY - black)
    return with_overrides(scene, {"sensor.noise": float(np.sqrt(max(variance, 0.0)))})


def measured_rows(known: Calibration, answers: Answers) -> tuple[VerdictRow, ...]:
    """Figures that were measured, with what to do where they are not good."""
    rows = _presses(known, answers)
    if known.pose:
        rows.append(_row("place of the plate", known.pose.error, "mm", PLATE))
    if known.projector:
        rows.append(_row("light on the plate", known.projector.error, "mm", LIGHT))
    if known.noise:
        rows.append(_row("noise in the dark", known.noise.read, "grey levels", NOISE))
    if known.latency:
        late = 1e3 * known.latency.median
        rows.append(_row("light comes late by", round(late), "ms", 1e3 * LATE))
    return tuple(rows)


def _presses(known: Calibration, answers: Answers) -> list[VerdictRow]:
    bench = known.bench
    if bench is None or bench.error is None:
        return []
    at = f"{answers.weight:.1f} N"
    rows = [_row(f"place of {at}", bench.error, "mm", PLACE, ADVICE["presses"])]
    if bench.error_force is not None:
        figure = f"{bench.error_force * answers.weight:.2g} N, {100 * bench.error_force:.2g} %"
        good = bench.error_force <= FORCE
        rows.append(VerdictRow(f"force of {at}", figure, good, "" if good else ADVICE["force"]))
    return rows


def _row(what: str, value: float, unit: str, limit: float, advice: str = "") -> VerdictRow:
    good = value <= limit
    return VerdictRow(what, f"{value:.3g} {unit}", good, "" if good else advice or ADVICE[what])


def noise_row(made: Design, answers: Answers) -> VerdictRow:
    """Say what noise alone leaves of the known weight in one frame, and what would help most."""
    place = float(np.median(made.errors["pattern"].place)) / answers.weight
    force = float(np.median(made.errors["pattern"].force))
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


def theory_row(made: Design, scene: Scene) -> VerdictRow:
    """Say up to which force the plate is linear."""
    wanted = scene.touches.force[1] if scene.touches else 0.0
    good = made.linear_to >= wanted
    advice = "" if good else "the theory of large touches is taken, which is slower to start"
    return VerdictRow("linear up to", f"{made.linear_to:.2g} N", good, advice)

"""Figures of a bench as each step has measured them, and whether they are good."""

from __future__ import annotations

from rig.calibration.store import Calibration
from rig.page.setup_view import VerdictRow
from rig.setup.answers import Answers
from rig.setup.steps import StepName

BOARD = 0.15  # mm: corners of a flat board that was held still
PLATE, LIGHT = 0.15, 0.3  # mm: of plate and projector, as a rehearsal reaches them
NOISE, LATE = 4.0, 0.1  # grey levels, s
PLACE, FORCE = 1.0, 0.02  # mm, fraction: of a press of the known weight
MEASURED: tuple[StepName, ...] = "presses", "lens", "pose", "projector", "noise", "latency"
"""Steps that measure something, in the order in which a verdict names them."""
ADVICE = {
    "presses": "lay the weight on the marks more exactly, or set the camera nearer",
    "force": "weigh the weight, and look whether the clamps hold",
    "corners of the board": "glue the board to something flat, and hold it stiller",
    "place of the plate": "find the lens anew with more tilted views, then the place",
    "light on the plate": "darken the room, focus the projector, and look for a bent plate",
    "noise in the dark": "more light and less gain",
    "light comes late by": "switch off what the projector does to images: game mode, keystone",
}
"""What to do where a figure is not good."""


def measured_rows(known: Calibration, answers: Answers) -> tuple[VerdictRow, ...]:
    """Figures that were measured, with what to do where they are not good."""
    return tuple(row for step in MEASURED for row in rows_of(step, known, answers))


def rows_of(step: StepName, known: Calibration, answers: Answers) -> tuple[VerdictRow, ...]:
    """Figures that a step has measured; none where it was not done, or measures nothing."""
    match step:
        case "lens" if known.lens:
            return (_row("corners of the board", known.lens.error, "mm", BOARD),)
        case "pose" if known.pose:
            return (_row("place of the plate", known.pose.error, "mm", PLATE),)
        case "projector" if known.projector:
            return (_row("light on the plate", known.projector.error, "mm", LIGHT),)
        case "noise" if known.noise:
            return (_row("noise in the dark", known.noise.read, "grey levels", NOISE),)
        case "latency" if known.latency:
            late = 1e3 * known.latency.median
            return (_row("light comes late by", round(late), "ms", 1e3 * LATE),)
        case "presses":
            return _presses(known, answers)
        case _:
            return ()


def advice_of(step: StepName, known: Calibration, answers: Answers) -> str:
    """Say what would make the figures of a step good; empty where they are."""
    return "; ".join(row.advice for row in rows_of(step, known, answers) if not row.good)


def _presses(known: Calibration, answers: Answers) -> tuple[VerdictRow, ...]:
    bench = known.bench
    if bench is None or bench.error is None:
        return ()
    at = f"{answers.weight:.1f} N"
    place = _row(f"place of {at}", bench.error, "mm", PLACE, ADVICE["presses"])
    if bench.error_force is None:
        return (place,)
    figure = f"{bench.error_force * answers.weight:.2g} N, {100 * bench.error_force:.2g} %"
    good = bench.error_force <= FORCE
    return place, VerdictRow(f"force of {at}", figure, good, "" if good else ADVICE["force"])


def _row(what: str, value: float, unit: str, limit: float, advice: str = "") -> VerdictRow:
    good = value <= limit
    return VerdictRow(what, f"{value:.3g} {unit}", good, "" if good else advice or ADVICE[what])

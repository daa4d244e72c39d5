"""What GenICam cameras have in common: features by the names of the SFNC, and a clock of their own.

Names after the Standard Features Naming Convention of the EMVA, with the older ones of GigE Vision.
"""

from __future__ import annotations

from collections import deque
from typing import Any, Protocol

from rig.camera.controls import Controls, Knob, Setting, hold
from rig.camera.reasons import unsupported

FORMAT = "Mono8"
VALUES = {
    Knob.EXPOSURE: ("ExposureTime", "ExposureTimeAbs"),
    Knob.GAIN: ("Gain", "GainRaw"),
    Knob.FOCUS: ("FocusPos",),
    Knob.WHITE_BALANCE: (),  # ratios of the channels, of which a grey camera has one
}
AUTOMATICS = {Knob.EXPOSURE: "ExposureAuto", Knob.GAIN: "GainAuto", Knob.FOCUS: "FocusAuto"}
STEPS = {Knob.EXPOSURE: 1e-6}  # s
RATES = ("AcquisitionFrameRate", "AcquisitionFrameRateAbs")
RECENT = (
    100  # frames whose quickest delivery places the device's clock; crystals drift 0.1 ms in 3 s
)


class Nodes(Protocol):
    """Features of a camera by name."""

    def get(self, name: str) -> Any:
        """Value; None where the camera has no such feature, or it may not be read."""
        ...

    def set(self, name: str, value: Any) -> bool:
        """Set a value; whether the camera accepted it."""
        ...


class NodePort:
    """Controls of a GenICam camera; see `rig.camera.controls.Port`."""

    def __init__(self, nodes: Nodes):
        self._nodes = nodes

    def manual(self, knob: Knob) -> bool:
        """See `Port.manual`."""
        automatic = AUTOMATICS.get(knob)
        if automatic is None or self._nodes.get(automatic) is None:
            return True
        self._nodes.set(automatic, "Off")
        return self._nodes.get(automatic) == "Off"

    def read(self, knob: Knob) -> float | None:
        """See `Port.read`."""
        values = (self._nodes.get(name) for name in VALUES[knob])
        value = next((value for value in values if value is not None), None)
        return None if value is None else float(value) * STEPS.get(knob, 1.0)

    def write(self, knob: Knob, value: float) -> bool:
        """See `Port.write`."""
        steps = value / STEPS.get(knob, 1.0)
        return any(self._nodes.set(name, steps) for name in VALUES[knob])


def set_up(
    nodes: Nodes, name: str, size: tuple[int, int], rate: float, controls: Controls
) -> tuple[Setting, ...]:
    """Set size, format and rate, then hold the controls.

    Raises
    ------
    OSError
        If the camera has no grey pictures of this size.
    """
    nodes.set("PixelFormat", FORMAT)
    for side, length in zip(("Width", "Height"), size, strict=True):
        nodes.set(side, length)
    got = tuple(nodes.get(feature) for feature in ("PixelFormat", "Width", "Height"))
    if got != (FORMAT, *size):
        offered = "{} {} × {} px".format(*got)
        raise unsupported(name, f"{size[0]} × {size[1]} px in {FORMAT}", offered)
    nodes.set("AcquisitionFrameRateEnable", True)
    any(nodes.set(feature, float(rate)) for feature in RATES)
    return hold(NodePort(nodes), controls)


class DeviceClock:
    """Puts the time stamps of a camera's own clock on ours.

    A picture arrives late by what its transport takes, and never early: the quickest of the last
    `RECENT` deliveries tells how far the clocks are apart.
    """

    def __init__(self):
        self._apart: deque[float] = deque(maxlen=RECENT)

    def ours(self, theirs: float, now: float) -> float:
        """Capture time, s; that of the arrival where the camera gives none (0)."""
        if theirs <= 0:
            return now
        self._apart.append(now - theirs)
        return theirs + min(self._apart)

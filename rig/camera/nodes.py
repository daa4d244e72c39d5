"""What GenICam cameras have in common: features by the names of the SFNC, and a clock of their own.

Names after the Standard Features Naming Convention of the EMVA, with the older ones of GigE Vision.
"""

from __future__ import annotations

from collections import deque
from typing import Any, Protocol

from rig.camera.controls import Controls, ControlSetting, Knob, hold
from rig.camera.panel import Panel
from rig.camera.reasons import unsupported

FORMAT = "Mono8"
VALUES = {
    Knob.EXPOSURE: ("ExposureTime", "ExposureTimeAbs"),
    Knob.GAIN: ("Gain", "GainRaw"),
    Knob.FOCUS: ("FocusPos",),
}
AUTOMATICS = {
    Knob.EXPOSURE: (("ExposureAuto",), "Off"),
    Knob.GAIN: (("GainAuto",), "Off"),
    Knob.FOCUS: (("FocusAuto",), "Off"),
}
"""White balance is a ratio of channels, and a grey image has one."""
STEPS = {Knob.EXPOSURE: 1e-6}  # s
RATES = ("AcquisitionFrameRate", "AcquisitionFrameRateAbs")
EACH_FRAME = "FrameStart"  # of the triggers that a camera may have
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


def set_up(
    nodes: Nodes,
    name: str,
    size: tuple[int, int],
    rate: float,
    controls: Controls,
    trigger: str | None = None,
) -> tuple[ControlSetting, ...]:
    """Set size, format and what takes each frame, then hold the controls.

    Parameters
    ----------
    nodes : Nodes
    name : str
        Of the camera, for the sentences.
    size : (int, int), px
        Width and height.
    rate : float, frames a second
    controls : Controls
    trigger : str or None
        Input whose rising edge takes each frame; None where the camera keeps the rate by itself.

    Raises
    ------
    OSError
        If the camera has no grey images of this size, or no such input.
    """
    nodes.set("PixelFormat", FORMAT)
    for side, length in zip(("Width", "Height"), size, strict=True):
        nodes.set(side, length)
    got = tuple(nodes.get(feature) for feature in ("PixelFormat", "Width", "Height"))
    if got != (FORMAT, *size):
        offered = "{} {} × {} px".format(*got)
        raise unsupported(name, f"{size[0]} × {size[1]} px in {FORMAT}", offered)
    nodes.set("AcquisitionFrameRateEnable", trigger is None)  # a pulse that is early counts too
    if trigger is None:
        _run_free(nodes)
        any(nodes.set(feature, float(rate)) for feature in RATES)
    else:
        _wait_for_pulses(nodes, name, trigger)
    return hold(_panel(nodes), controls)


def _run_free(nodes: Nodes) -> None:
    """Take frames without pulses, also where the maker's program had set the camera otherwise."""
    nodes.set("TriggerSelector", EACH_FRAME)
    nodes.set("TriggerMode", "Off")


def _wait_for_pulses(nodes: Nodes, name: str, trigger: str) -> None:
    nodes.set("TriggerSelector", EACH_FRAME)
    nodes.set("TriggerActivation", "RisingEdge")
    if not (nodes.set("TriggerSource", trigger) and nodes.set("TriggerMode", "On")):
        raise OSError(
            f"{name} takes no frames by its input '{trigger}'; set source.trigger to an input that"
            " the maker's program lists under TriggerSource, or leave it out"
        )


def by_pulses(name: str, trigger: str | None) -> str:
    """Name of a camera with what takes its frames, so that a sentence on silence says it too."""
    return name if trigger is None else f"{name}, triggered by {trigger},"


class DeviceClock:
    """Puts the time stamps of a camera's own clock on ours.

    An image arrives late by what its transport takes, and never early: the quickest of the last
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


def _panel(nodes: Nodes) -> Panel[tuple[str, ...]]:
    """Make the panel of a camera, where each control has one of several names."""

    def get(names: tuple[str, ...]) -> Any:
        found = (nodes.get(name) for name in names)
        return next((value for value in found if value is not None), None)

    def put(names: tuple[str, ...], value: Any) -> bool:
        return any(nodes.set(name, value) for name in names)

    return Panel(VALUES, AUTOMATICS, STEPS, get, put)

"""Exposure, gain, focus and white balance held still: first the automatics off, then the values.

Correlation compares images of the same light. A camera that still adjusts itself changes them
all the time, and most cameras refuse a value while the automatic that owns it is on. So the order
is the same for every kind of camera and stands here, and each kind brings a `Port`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

CLOSE = 0.02  # relative; cameras round to their own steps: 100 µs of exposure on UVC


class Knob(StrEnum):
    """What is held still, in the order in which it is set."""

    EXPOSURE = "exposure"
    GAIN = "gain"
    FOCUS = "focus"
    WHITE_BALANCE = "white balance"


UNITS = {Knob.EXPOSURE: " s", Knob.GAIN: "", Knob.FOCUS: "", Knob.WHITE_BALANCE: " K"}


@dataclass(frozen=True)
class Controls:
    """Values to hold; None holds the value that the camera has when it is opened.

    Attributes
    ----------
    exposure : float or None, s
    gain, focus : float or None
        In steps of the camera.
    white_balance : float or None, K
    """

    exposure: float | None = None
    gain: float | None = None
    focus: float | None = None
    white_balance: float | None = None

    def __post_init__(self):
        if self.exposure is not None and not self.exposure > 0:
            raise ValueError(
                f"exposure must be positive, got {self.exposure:g} s; a fast start is 0.01 s"
            )

    def of(self, knob: Knob) -> float | None:
        """Value that was asked for."""
        return getattr(self, knob.name.lower())


@dataclass(frozen=True)
class ControlSetting:
    """What became of one control.

    Attributes
    ----------
    knob : Knob
    asked : float or None
        Value that was to be held; None if the camera's own.
    got : float or None
        Value that the camera says it has; None if it does not have the control, or we have no way
        to it.
    manual : bool
        Whether the camera leaves it alone from now on.
    """

    knob: Knob
    asked: float | None
    got: float | None
    manual: bool

    @property
    def held(self) -> bool:
        """Whether the camera holds what was asked."""
        if self.got is None or not self.manual:
            return False
        return self.asked is None or abs(self.got - self.asked) <= CLOSE * abs(self.asked)

    @property
    def sentence(self) -> str:
        """What happened, for the user."""
        if self.got is None:
            return f"the {self.knob} of the camera cannot be held"
        unit = UNITS[self.knob]
        if not self.manual:
            return f"the camera still sets its {self.knob} itself, now {self.got:g}{unit}"
        if not self.held:
            return f"{self.knob} {self.asked:g}{unit} was refused, it is {self.got:g}{unit}"
        return f"{self.knob} is held at {self.got:g}{unit}"


class Port(Protocol):
    """The controls of one camera, in its own terms."""

    def manual(self, knob: Knob) -> bool:
        """Switch off what sets this knob by itself; whether nothing does now."""
        ...

    def read(self, knob: Knob) -> float | None:
        """Value; None where the camera does not have the knob."""
        ...

    def write(self, knob: Knob, value: float) -> bool:
        """Set the value; whether the camera accepted it."""
        ...


def hold(port: Port, controls: Controls) -> tuple[ControlSetting, ...]:
    """Switch the automatics off, set the values and read them back.

    A control that the camera lacks is only reported where a value was asked for. Nothing raises
    because a camera refuses: what it did is in the settings.
    """
    found = {knob: port.read(knob) for knob in Knob}
    manual = {knob: port.manual(knob) for knob in Knob if found[knob] is not None}
    settings: list[ControlSetting] = []
    for knob in Knob:
        asked, before = controls.of(knob), found[knob]
        if before is None:
            if asked is not None:
                settings.append(ControlSetting(knob, asked, None, manual=False))
            continue
        # the value that the automatic had found goes back in: manual mode brings an older one
        port.write(knob, before if asked is None else asked)
        settings.append(ControlSetting(knob, asked, port.read(knob), manual[knob]))
    return tuple(settings)

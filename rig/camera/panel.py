"""The controls of cameras that have a numbered or named value for each knob."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from rig.camera.controls import Knob

Key = TypeVar("Key")


@dataclass(frozen=True)
class Panel(Generic[Key]):
    """A `rig.camera.controls.Port`, which differs between kinds of cameras by its tables alone.

    Attributes
    ----------
    values : mapping of Knob to key
        What holds the value of each knob.
    automatics : mapping of Knob to (key, value)
        What sets a knob by itself, and its value when it does not.
    steps : mapping of Knob to float
        Size of one step of the camera in our unit, where it is not 1.
    get : callable
        Value of a key; None where the camera does not have it.
    set : callable
        Sets the value of a key; whether the camera accepted it.
    """

    values: Mapping[Knob, Key]
    automatics: Mapping[Knob, tuple[Key, Any]]
    steps: Mapping[Knob, float]
    get: Callable[[Key], Any]
    set: Callable[[Key, Any], bool]

    def manual(self, knob: Knob) -> bool:
        """See `Port.manual`."""
        if knob not in self.automatics:
            return True
        automatic, off = self.automatics[knob]
        if self.get(automatic) is None:
            return True
        self.set(automatic, off)
        return self.get(automatic) == off

    def read(self, knob: Knob) -> float | None:
        """See `Port.read`."""
        value = self.get(self.values[knob]) if knob in self.values else None
        return None if value is None else float(value) * self.steps.get(knob, 1.0)

    def write(self, knob: Knob, value: float) -> bool:
        """See `Port.write`."""
        return knob in self.values and self.set(
            self.values[knob], value / self.steps.get(knob, 1.0)
        )

"""Touches as a stream of the Lab Streaming Layer, beside EEG and the like (extra "lsl").

Gestures are a second stream, of markers as EEG programs have them: one text a gesture, its kind.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from importlib import import_module
from math import nan
from typing import Any

from rig.live.gestures import Gesture
from rig.live.snapshot import Mark, Snapshot
from rig.system.newcomers import Newcomers
from rig.system.optional import need

FIELDS = (
    ("id", "none"), ("x", "mm"), ("y", "mm"), ("force", "N"),
    ("sigma_x", "mm"), ("sigma_y", "mm"), ("sigma_force", "N"),
)  # fmt: skip
"""Channels of each touch; `sigma_x` and `sigma_y` are the semi-axes of the ellipse."""


class LslOutlet:
    """Sends one sample a frame: the fields of `max_touches` touches, NaN where there is none.

    Parameters
    ----------
    max_touches : int
        Touches in a sample; the hardest pressed are sent.
    name : str
        Name under which clients find the stream; its type is ``Touch``. That of the gestures is
        followed by ``-gestures``; its type is ``Markers``.

    Raises
    ------
    OSError
        If pylsl is not installed.
    ValueError
        If no touch has room.
    """

    def __init__(self, max_touches: int, name: str = "touchplate"):
        if max_touches < 1:
            raise ValueError(f"an LSL sample must have room for 1 touch or more, got {max_touches}")
        need("pylsl", "lsl")
        self._lsl = import_module("pylsl")
        self._max_touches = max_touches
        info = self._lsl.StreamInfo(
            name, "Touch", max_touches * len(FIELDS), self._lsl.IRREGULAR_RATE, "float32", name
        )
        channels = info.desc().append_child("channels")
        for number in range(1, max_touches + 1):
            for field, unit in FIELDS:
                channel = channels.append_child("channel")
                channel.append_child_value("label", f"{field}_{number}")
                channel.append_child_value("unit", unit)
        self._outlet = self._lsl.StreamOutlet(info)
        self._markers = self._lsl.StreamOutlet(_markers(self._lsl, f"{name}-gestures"))
        self._new_gestures = Newcomers[Gesture]()

    def __call__(self, snapshot: Snapshot) -> None:
        """Send the touches of a frame, stamped with its time, and its new gestures with theirs."""
        age = time.monotonic() - snapshot.given
        taken = self._lsl.local_clock() - age
        self._outlet.push_sample(sample(snapshot.touches, self._max_touches), taken)
        for gesture in self._new_gestures(snapshot.gestures):
            self._markers.push_sample([gesture.kind], taken - (snapshot.captured - gesture.time))


def _markers(lsl: Any, name: str) -> Any:
    """Describe a stream of markers."""
    return lsl.StreamInfo(name, "Markers", 1, lsl.IRREGULAR_RATE, "string", name)


def sample(marks: Sequence[Mark], max_touches: int) -> list[float]:
    """Numbers of a sample, touch after touch."""
    hardest = sorted(marks, key=lambda mark: -mark.force)[:max_touches]
    rows = [
        (nan if mark.identity is None else mark.identity, mark.x, mark.y, mark.force,
         *mark.sigma[:2], mark.sigma_force)
        for mark in hardest
    ]  # fmt: skip
    rows += [(nan,) * len(FIELDS)] * (max_touches - len(rows))
    return [float(value) for row in rows for value in row]

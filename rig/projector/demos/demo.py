"""All demos by the name that a scene gives them."""

from __future__ import annotations

from typing import Literal

from rig.projector.demos.keys import Keys, begin_keys
from rig.projector.demos.painting import Painting
from rig.projector.demos.ripples import Ripples
from rig.projector.demos.trails import Trails
from rig.projector.demos.weighing import Weighing

DemoName = Literal["ripples", "trails", "scale", "painting", "keys"]
Demo = Ripples | Trails | Weighing | Painting | Keys
"""Each goes on by `after`, is set back by `tared`, and draws itself by `drawn`."""


def begin_demo(name: DemoName, plate_size: tuple[float, float], full: float) -> Demo:
    """Begin a demo on a plate that nobody touches.

    Parameters
    ----------
    name : str
    plate_size : (a, b), mm
    full : float, N
        The largest load that is expected.
    """
    match name:
        case "ripples":
            return Ripples(plate_size)
        case "trails":
            return Trails(plate_size)
        case "scale":
            return Weighing(plate_size, full)
        case "painting":
            return Painting(plate_size)
        case "keys":
            return begin_keys(plate_size)

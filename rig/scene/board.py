"""Section for a USB board beside the camera: its lamp, and the trigger of the camera."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from rig.scene.quantity import Count, Ratio, Time
from rig.scene.section import Section

Pin = Annotated[Count, Field(ge=0, le=255)]


class BoardSection(Section):
    """A board on the USB that lights the plate and triggers the camera while frames are taken."""

    serial: Annotated[str, Field(min_length=1)] | None = Field(
        None, description="its serial number [the only board there is]"
    )
    lamp: Annotated[Ratio, Field(ge=0, le=1)] | None = Field(
        None, description="light of its lamp, 0 to 1 [it has none]"
    )
    lamp_output: Pin = Field(0, description="output of the lamp")
    trigger_width: Annotated[Time, Field(gt=0, le=1)] | None = Field(
        None, description="pulses that trigger the camera at its rate, s [it runs by itself]"
    )
    trigger_output: Pin = Field(1, description="output of the trigger")

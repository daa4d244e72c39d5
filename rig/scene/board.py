"""Section for a USB board beside the camera: its lamp, its foot switch, the camera's trigger."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from rig.scene.quantity import Count, Ratio, Time
from rig.scene.section import Section

Pin = Annotated[Count, Field(ge=0, le=255)]


class BoardSection(Section):
    """A board on the USB: a lamp and the camera's trigger while frames are taken, a foot switch."""

    serial: Annotated[str, Field(min_length=1)] | None = Field(
        None, description="its serial number [the only board there is]"
    )
    lamp: Annotated[Ratio, Field(ge=0, le=1)] | None = Field(
        None, description="light of its lamp, 0 to 1 [it has none]"
    )
    lamp_follows: Literal["touch", "force"] | None = Field(
        None,
        description="whether its lamp is lit where something touches, or as bright as all forces"
        " together; such a lamp must not light the plate [it is steady]",
    )
    lamp_output: Pin = Field(0, description="output of the lamp")
    trigger_width: Annotated[Time, Field(gt=0, le=1)] | None = Field(
        None, description="pulses that trigger the camera at its rate, s [it runs by itself]"
    )
    trigger_output: Pin = Field(1, description="output of the trigger")
    foot_switch: Literal["tare", "record", "snapshot"] | None = Field(
        None,
        description="what a press of its foot switch does: renew the reference, begin or end a"
        " recording, or keep image and touches of the frame [it has none]",
    )
    foot_switch_input: Pin = Field(0, description="input of the foot switch")

    @model_validator(mode="after")
    def _has_the_lamp(self) -> BoardSection:
        if self.lamp_follows and self.lamp is None:
            raise PydanticCustomError(
                "scene",
                "board.lamp_follows is '{follows}', and the board has no lamp; set board.lamp to"
                " its largest light, such as 1.0",
                {"follows": self.lamp_follows},
            )
        return self

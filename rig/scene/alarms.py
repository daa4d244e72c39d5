"""Section for what an operator is to be alarmed of."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from rig.scene.quantity import Count, Force, Time
from rig.scene.section import Section


class AlarmsSection(Section):
    """Bounds of a run: what is beyond one is noted on page and terminal, and sent to outputs."""

    force: Annotated[Force, Field(gt=0)] | None = Field(
        None, description="largest force of a touch, N [any]"
    )
    silence: Annotated[Time, Field(gt=0)] | None = Field(
        None, description="longest time without a frame, s [any]"
    )
    disk: Annotated[Count, Field(ge=1)] | None = Field(
        None, description="least space that is free where the run was started, MB [any]"
    )
    dropped: Annotated[Count, Field(ge=0)] | None = Field(
        None, description="most frames that are dropped in a minute [any]"
    )

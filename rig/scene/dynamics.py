"""Section for the plate in time: how it rings under taps, and how it creeps under presses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from rig.scene.quantity import Density, Ratio, Time
from rig.scene.section import Section

if TYPE_CHECKING:
    from models import Creep

Part = Annotated[Ratio, Field(ge=0, lt=0.5)]
Lasting = Annotated[Time, Field(gt=0)]


class DynamicsSection(Section):
    """The plate in time. Without it each frame is taken as an equilibrium."""

    density: Density | None = Field(
        None, gt=0, description="density of the plate, kg/m³ [its ringing is not followed]"
    )
    damping: Ratio = Field(
        0.02,
        gt=0,
        lt=0.5,
        description="damping of its modes over critical damping, half the loss factor",
    )
    exposure: Time | None = Field(
        None, gt=0, description="exposure, s [that of the source, or a quarter of the interval]"
    )
    creep: tuple[tuple[Part, Lasting], ...] = Field(
        (),
        max_length=2,
        description="up to two terms of creep: what each adds to the deflection in the end, parts"
        " of it, and its time, s",
    )

    @model_validator(mode="after")
    def _something(self) -> DynamicsSection:
        if self.density is None and not self.creep:
            raise PydanticCustomError(
                "scene",
                "[dynamics] names neither a density nor creep, so that nothing is followed; give"
                " dynamics.density or dynamics.creep, or leave [dynamics] out",
            )
        return self

    def build_creep(self) -> Creep | None:
        """Return the creep that `models` knows; None where none is named."""
        if not self.creep:
            return None
        from models import Creep

        parts, times = zip(*self.creep, strict=True)
        return Creep(tuple(parts), tuple(times))

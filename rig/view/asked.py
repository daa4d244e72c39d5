"""What a page asks for, checked before anything is done with it."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from rig.series.regions import Extensometer, Gauge, Polygon, Regions, first_fault

_Number = Annotated[float, Field(allow_inf_nan=False)]
Ends = tuple[_Number, _Number, _Number, _Number]
"""(x1, y1, x2, y2), px."""


class _Asked(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class AskedSettings(_Asked):
    """How images shall be correlated."""

    reference: Annotated[str, Field(description="Name of the image before.")]
    subset: Annotated[int, Field(description="px, odd.")] = 21
    step: Annotated[int, Field(description="px.")] = 5
    order: Annotated[int, Field(description="Of the shape function.")] = 1
    window: Annotated[int, Field(description="Points, odd.")] = 5
    kind: Literal["small", "green-lagrange", "logarithmic"] = "small"
    scale: Annotated[str, Field(description="Two points, px, and their distance; or empty.")] = ""
    roi: list[Polygon] = []
    extensometer: list[Extensometer] = []
    gauge: list[Gauge] = []

    @property
    def regions(self) -> Regions:
        """Regions that the test reads and is limited to."""
        return Regions(roi=self.roi, extensometer=self.extensometer, gauge=self.gauge)


class AskedLine(_Asked):
    """A field to be read at a point (its ends are one), or along a line."""

    field: str
    ends: Ends
    frame: Annotated[int | None, Field(description="None for all of them.")] = None


class AskedGauges(_Asked):
    """Extensometers and gauges to be read in all frames, or in one."""

    extensometer: list[Extensometer] = []
    gauge: list[Gauge] = []
    frame: int | None = None

    @property
    def regions(self) -> Regions:
        """Regions to be read."""
        return Regions(extensometer=self.extensometer, gauge=self.gauge)

    @model_validator(mode="after")
    def _has_one(self) -> Self:
        if not (self.extensometer or self.gauge):
            raise ValueError("there is nothing to read, neither an extensometer nor a gauge")
        return self


def first_sentence(error: ValidationError) -> str:
    """Return what is wrong with what was asked, as one sentence."""
    return f"{first_fault(error)}; correct it on the page"

"""Section for the net that corrects displacement fields."""

from __future__ import annotations

from pydantic import Field

from rig.scene.quantity import Count
from rig.scene.section import Section


class FieldNetSection(Section):
    """How the field net is trained: on drawn fields, plates under touches among them.

    Steps on rendered images may follow.

    It belongs to no plate; `touchplate correlate --field net` takes it.
    """

    steps: Count = Field(1000, ge=1, description="steps of the training")
    seed: Count = Field(17, ge=0, description="seed of weights, plates and fields")
    pairs: Count = Field(4, ge=1, le=256, description="fields of two components a step")
    side: Count = Field(
        96, ge=32, le=256, multiple_of=4, description="tiles along a side of a field"
    )
    learning_rate: float = Field(3e-3, gt=0, le=1, description="learning rate at first")
    horizon: Count = Field(3000, ge=1, description="steps over which the learning rate falls to 0")
    plates: Count = Field(120, ge=1, le=10000, description="plates under touches that are solved")
    rendered: Count = Field(0, ge=0, description="steps that follow, on rendered images too")
    rendered_side: Count = Field(
        320, ge=160, le=1024, multiple_of=4, description="pixels along a side of these images"
    )
    rendered_rate: float = Field(1e-3, gt=0, le=1, description="learning rate of these at first")
    patterns: Count = Field(48, ge=1, le=1000, description="speckle patterns that are drawn")

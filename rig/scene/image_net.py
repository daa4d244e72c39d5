"""Section for the net that refines displacement from a pair of images."""

from __future__ import annotations

from pydantic import Field

from rig.scene.quantity import Count
from rig.scene.section import Section


class ImageNetSection(Section):
    """How the image net is trained: on rendered speckle that moves by drawn fields and plates.

    It belongs to no plate; `touchplate correlate --field image-net` takes it.
    """

    steps: Count = Field(2900, ge=1, description="steps of the training")
    seed: Count = Field(17, ge=0, description="seed of weights, patterns, plates and fields")
    pairs: Count = Field(1, ge=1, le=64, description="pairs of images that are rendered a step")
    side: Count = Field(
        160, ge=96, le=512, multiple_of=16, description="pixels along a side of an image"
    )
    learning_rate: float = Field(2e-3, gt=0, le=1, description="learning rate at first")
    horizon: Count = Field(4200, ge=1, description="steps over which the learning rate falls to 0")
    patterns: Count = Field(72, ge=1, le=1000, description="speckle patterns that are drawn")
    plates: Count = Field(60, ge=1, le=10000, description="plates under touches that are solved")

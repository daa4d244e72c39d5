"""Section for the net that reads touches from the whole pattern."""

from __future__ import annotations

from pydantic import Field

from rig.scene.quantity import Count, Ratio
from rig.scene.section import Section


class TouchNetSection(Section):
    """How the touch net is trained: on touches drawn on benches about the one of the scene.

    `estimator.start` takes it.
    """

    steps: Count = Field(60000, ge=1, description="steps of the net that proposes touches")
    head_steps: Count = Field(
        5000, ge=1, description="steps of the net that looks at how proposals fit, after those"
    )
    seed: Count = Field(17, ge=0, description="seed of weights, benches and touches")
    batch: Count = Field(512, ge=1, le=65536, description="measurements a step")
    head_batch: Count = Field(128, ge=8, le=65536, description="measurements a step after those")
    learning_rate: Ratio = Field(2e-3, gt=0, description="learning rate at first")
    benches: Count = Field(
        11, ge=0, le=1000, description="benches that are drawn beside the one of the scene"
    )
    margin: Ratio = Field(
        0.1, ge=0.02, lt=0.5, description="fraction of a side at each edge in which no touch lies"
    )

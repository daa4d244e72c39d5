"""The scene: everything that one TOML file says about a bench."""

from __future__ import annotations

from typing import Any, cast

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from rig.scene.alarms import AlarmsSection
from rig.scene.bench import AnyGauges, CameraSection, PatternSection, SensorSection
from rig.scene.board import BoardSection
from rig.scene.dataset import DatasetSection
from rig.scene.dynamics import DynamicsSection
from rig.scene.field_net import FieldNetSection
from rig.scene.image_net import ImageNetSection
from rig.scene.loop import Outputs, Page, ProjectorSection
from rig.scene.plate import BaseSection, PlateSection, TouchesSection
from rig.scene.renamed import with_new_keys
from rig.scene.section import Section
from rig.scene.sensing import DicSection, Estimator, TrainingSection
from rig.scene.source import MachineVision, Source
from rig.scene.touch_net import TouchNetSection

NEEDS = {
    "base": ("plate",),
    "touches": ("plate",),
    "camera": ("plate",),
    "pattern": ("plate",),
    "gauges": ("plate",),
    "sensor": ("camera",),
    "dic": ("camera",),
    "source": ("plate", "camera"),
    "board": ("source",),
    "outputs": ("plate",),
    "training": ("gauges",),
    "dataset": ("gauges",),
    "comparison": ("estimator",),
    "dynamics": ("plate", "camera", "estimator"),
    "touch_net": ("plate", "touches", "camera", "pattern", "sensor", "dic"),
}
"""Sections that make no sense without others."""

ESTIMATOR_NEEDS = {
    "pattern": ("plate", "dic"),
    "strain": ("plate", "dic"),
    "net": ("gauges", "training"),
    "regression": ("gauges", "training"),
}
"""The same for each kind of estimator."""


SOURCE_NEEDS: dict[str, tuple[str, ...]] = {"twin": ("pattern", "sensor")}
"""The same for kinds of source; a camera sees what is there."""


class Scene(Section):
    """A bench and what is to be done with it; a section that is absent is None.

    Raises
    ------
    pydantic.ValidationError
        If a section is wrong in itself or lacks another; `load` turns it into one sentence.
    """

    title: str = Field(description="one line that says what the scene is")
    plate: PlateSection | None = Field(None, description="the plate that is touched")
    base: BaseSection | None = Field(None, description="how the plate is bent before any touch")
    touches: TouchesSection | None = Field(None, description="the touches that are expected")
    camera: CameraSection | None = Field(None, description="the camera")
    pattern: PatternSection | None = Field(None, description="the speckle pattern")
    sensor: SensorSection | None = Field(None, description="the sensor of the camera")
    dynamics: DynamicsSection | None = Field(
        None, description="the plate in time: ringing and creep"
    )
    gauges: AnyGauges | None = Field(None, description="strain gauges")
    dic: DicSection | None = Field(None, description="correlation")
    estimator: Estimator | None = Field(None, description="what finds the touches")
    comparison: Estimator | None = Field(
        None, description="a second estimator, shown beside the first"
    )
    training: TrainingSection | None = Field(None, description="training and test touches")
    dataset: DatasetSection | None = Field(None, description="samples of touches on disk")
    field_net: FieldNetSection | None = Field(
        None, description="training of the net that corrects displacement fields"
    )
    image_net: ImageNetSection | None = Field(
        None, description="training of the net that refines displacement from a pair of images"
    )
    touch_net: TouchNetSection | None = Field(
        None, description="training of the net that reads touches from the whole pattern"
    )
    source: Source | None = Field(None, description="where frames come from")
    board: BoardSection | None = Field(None, description="a USB board: lamp and trigger")
    page: Page | None = Field(None, description="the operator page")
    projector: ProjectorSection | None = Field(None, description="the projector window")
    outputs: Outputs | None = Field(None, description="where touches are sent to")
    alarms: AlarmsSection | None = Field(None, description="bounds that an operator is alarmed of")

    @model_validator(mode="before")
    @classmethod
    def _renamed(cls, data: Any) -> Any:
        return with_new_keys(cast("dict[str, Any]", data)) if isinstance(data, dict) else data

    @model_validator(mode="after")
    def _complete(self) -> Scene:
        for section, others in self._needs():
            for other in others:
                if getattr(self, other) is None:
                    raise PydanticCustomError(
                        "scene",
                        "[{section}] needs [{other}]; add [{other}] or leave [{section}] out",
                        {"section": section, "other": other},
                    )
        return self

    @model_validator(mode="after")
    def _consistent(self) -> Scene:
        if self.touches and self.touches.force[0] > self.touches.force[1]:
            low, high = self.touches.force
            raise PydanticCustomError(
                "scene",
                "touches.force runs from {low} N down to {high} N; write the smaller force first",
                {"low": f"{low:g}", "high": f"{high:g}"},
            )
        if self.gauges and self.gauges.subset and not self.camera:
            raise PydanticCustomError(
                "scene",
                "gauges.subset has DIC read the gauges, and [camera] is not there; add [camera] or"
                " leave gauges.subset out",
            )
        if self.touches and self.plate and 2 * self.touches.radius > min(self.plate.size):
            raise PydanticCustomError(
                "scene",
                "touches.radius is {radius} mm; give at most half of the plate's shorter side,"
                " {half} mm",
                {"radius": f"{self.touches.radius:g}", "half": f"{min(self.plate.size) / 2:g}"},
            )
        if self.training and self.plate and self.training.margin >= min(self.plate.size) / 2:
            raise PydanticCustomError(
                "scene",
                "training.margin is {margin} mm; give less than half of the plate's shorter side,"
                " {half} mm",
                {"margin": f"{self.training.margin:g}", "half": f"{min(self.plate.size) / 2:g}"},
            )
        return self

    @model_validator(mode="after")
    def _triggered(self) -> Scene:
        """Refuse pulses of the board that a camera could wait for, and does not."""
        sends = self.board is not None and self.board.trigger_width is not None
        if sends and isinstance(self.source, MachineVision) and self.source.trigger is None:
            raise PydanticCustomError(
                "scene",
                "board.trigger_width sends pulses and the camera runs by itself; set source.trigger"
                " to its input, such as Line1, or leave board.trigger_width out",
            )
        return self

    def _needs(self) -> list[tuple[str, tuple[str, ...]]]:
        needs: list[tuple[str, tuple[str, ...]]] = [
            (name, others) for name, others in NEEDS.items() if getattr(self, name)
        ]
        for name in ("estimator", "comparison"):
            if estimator := getattr(self, name):
                needs.append((name, ESTIMATOR_NEEDS[estimator.kind]))
        if self.source:
            needs.append(("source", SOURCE_NEEDS.get(self.source.kind, ())))
        return needs

"""Sections for the things that look at the plate: camera, pattern, sensor, gauges."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from rig.scene.quantity import LARGEST_SIDE, Count, Grey, Length, Rate, Ratio, Time, odd
from rig.scene.section import Section

if TYPE_CHECKING:
    import numpy as np

    import synthetic
    from rig.scene.plate import PlateSection


Side = Annotated[Count, Field(ge=64, le=LARGEST_SIDE)]


class LensSection(Section):
    """The lens of a camera, for what `touchplate design` says of focus; a twin shows all sharp."""

    focal: Length = Field(gt=0, description="focal length, mm")
    f_number: Ratio = Field(gt=0, description="focal length over the diameter of the aperture")
    focus: Length = Field(gt=0, description="distance from the lens of what is sharp, mm")

    @model_validator(mode="after")
    def _focuses(self) -> LensSection:
        if self.focus <= self.focal:
            raise PydanticCustomError(
                "scene",
                "camera.lens.focus is {focus} mm, and a lens of {focal} mm shows nothing sharp that"
                " is nearer than its focal length; give more",
                {"focus": f"{self.focus:g}", "focal": f"{self.focal:g}"},
            )
        return self


class CameraSection(Section):
    """A camera before the middle of the plate, above its touched face or below it."""

    kind: Literal["pinhole", "telecentric"] = Field("pinhole", description="projection")
    pixels: tuple[Side, Side] = Field(description="width and height of the image, px")
    stand_off: Length = Field(gt=0, description="distance from the plate, mm")
    margin: Ratio = Field(
        0.02, ge=0, lt=0.5, description="fraction of the image left free on each side"
    )
    rate: Rate = Field(30.0, gt=0, description="images a second, fps")
    side: Literal["above", "below"] = Field(
        "above",
        description="looks at the touched face; or from below at the other, with plate x to the"
        " left in its image",
    )

    row_time: Time = Field(
        0.0,
        ge=0,
        description="from the reading of one row to that of the next, s: a rolling shutter; 0 where"
        " all rows are exposed at once",
    )

    lens: LensSection | None = Field(
        None, description="its lens, by which a design knows what is in focus [all is sharp]"
    )

    @model_validator(mode="after")
    def _has_an_aperture_that_counts(self) -> CameraSection:
        if self.lens is not None and self.kind != "pinhole":
            raise PydanticCustomError(
                "scene",
                "camera.lens is that of a pinhole camera, and kind is '{kind}'; leave one of them"
                " out",
                {"kind": self.kind},
            )
        return self

    @model_validator(mode="after")
    def _read_in_time(self) -> CameraSection:
        if self.readout * self.rate > 1.0:
            raise PydanticCustomError(
                "scene",
                "camera.row_time of {row} µs reads {rows} rows in {readout} ms, longer than a frame"
                " at {rate} fps; look up the time of one row",
                {
                    "row": f"{1e6 * self.row_time:g}",
                    "rows": str(self.pixels[1]),
                    "readout": f"{1e3 * self.readout:.3g}",
                    "rate": f"{self.rate:g}",
                },
            )
        return self

    @property
    def readout(self) -> float:
        """Time from the reading of the first row to that of the last, s."""
        return self.row_time * (self.pixels[1] - 1)

    @property
    def face(self) -> synthetic.Face:
        """Face of the plate that it sees."""
        return "top" if self.side == "above" else "bottom"

    def build(self, plate: PlateSection) -> synthetic.AnyCamera:
        """Return the camera that sees the whole of `plate`."""
        import synthetic

        cameras = {
            ("pinhole", "top"): synthetic.pinhole_above,
            ("pinhole", "bottom"): synthetic.pinhole_below,
            ("telecentric", "top"): synthetic.telecentric_above,
            ("telecentric", "bottom"): synthetic.telecentric_below,
        }
        return cameras[self.kind, self.face](
            plate.size, stand_off=self.stand_off, pixels=self.pixels, margin=self.margin
        )


class PatternSection(Section):
    """The speckle pattern on the face that the camera sees."""

    diameter: Length = Field(gt=0, description="diameter of a speckle, mm")
    density: Ratio = Field(0.5, gt=0, lt=1, description="fraction of the face that speckles cover")
    contrast: Ratio = Field(1.0, gt=0, le=1, description="darkness of a speckle, 0 to 1")
    softness: Ratio = Field(
        0.4, gt=0, le=0.8, description="width of a speckle's edge over its diameter"
    )
    seed: Count = Field(0, ge=0, description="seed of the random places")

    def build(self, plate: PlateSection) -> synthetic.Pattern:
        """Return the pattern drawn over `plate`."""
        import synthetic

        return synthetic.speckle(size=plate.size, **self.model_dump())


class SensorSection(Section):
    """The sensor of the camera."""

    noise: Grey = Field(2.0, ge=0, description="standard deviation of its noise, grey levels")
    bits: Literal[8] = Field(8, description="bits of a grey level")

    def build(self) -> synthetic.Sensor:
        """Return the sensor that `synthetic` knows."""
        import synthetic

        return synthetic.Sensor(noise=self.noise, bits=self.bits)


class GaugesSection(Section):
    """What all arrangements of gauges have in common."""

    spacing: Length = Field(5.0, gt=0, description="distance of neighbours, mm")
    subset: Annotated[Count, Field(ge=5, le=999)] | None = Field(
        None,
        description="side of the subset by which DIC reads a gauge through [camera], px, odd"
        " [the strain of the face itself is read]",
    )

    @field_validator("subset")
    @classmethod
    def _odd(cls, value: int | None) -> int | None:
        return value if value is None else odd(value)


class RingSection(GaugesSection):
    """Strain gauges in a ring along the edges, as in the paper.

    The paper does not show where they lie; on the edges they reproduce its figures.
    """

    kind: Literal["ring"] = Field("ring", description="arrangement")
    placement: Literal["inside", "edges"] = Field(
        "edges", description="on the edges themselves, or `margin` inside them"
    )
    margin: Length = Field(
        5.0, ge=0, description="distance from corners, and from edges where inside, mm"
    )

    def build(self, plate: PlateSection) -> np.ndarray:
        """Return the places on `plate`, (M, 2) float64, mm."""
        from models import gauges_inside_edges, gauges_on_edges

        places = {"inside": gauges_inside_edges, "edges": gauges_on_edges}[self.placement]
        return places(plate.size, self.spacing, self.margin)


class LatticeSection(GaugesSection):
    """Strain gauges on a grid over the middle of the plate, which DIC reads as easily as a ring."""

    kind: Literal["lattice"] = Field(description="arrangement")
    margin: Length = Field(5.0, ge=0, description="distance from the edges, mm")

    def build(self, plate: PlateSection) -> np.ndarray:
        """Return the places on `plate`, (M, 2) float64, mm."""
        from models import grid_places

        return grid_places(plate.size, self.spacing, self.margin)


AnyGauges = Annotated[RingSection | LatticeSection, Field(discriminator="kind")]

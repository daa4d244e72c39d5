"""Sections for the plate: its patches, its base and the touches that are expected on it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from rig.scene.edges import Edges, Taper, give_in_plane
from rig.scene.quantity import Angle, Count, Force, Kelvin, Length, LineForce, Ratio, Stress
from rig.scene.section import Section

if TYPE_CHECKING:
    import fe

Positive = Field(gt=0)
Span = tuple[Length, Length]


class PatchSection(Section):
    """A rectangle of another thickness or stiffness about the same middle plane."""

    x: Span = Field(description="from and to along x, mm")
    y: Span = Field(description="from and to along y, mm")
    thickness: Length | None = Field(None, gt=0, description="thickness, mm [that of the plate]")
    young: Stress | None = Field(None, gt=0, description="Young's modulus, MPa [of the plate]")

    def build(self, plate: PlateSection) -> fe.Patch:
        """Return the patch that `fe` knows."""
        import fe

        return fe.Patch(
            self.x, self.y, self.thickness or plate.thickness, self.young or plate.young
        )


class PlateSection(Section):
    """The plate that is touched."""

    size: tuple[Annotated[Length, Positive], Annotated[Length, Positive]] = Field(
        description="sides along x and y, mm"
    )
    thickness: Length = Field(gt=0, description="thickness, mm")
    young: Stress = Field(gt=0, description="Young's modulus, MPa")
    poisson: Ratio = Field(gt=-1, lt=0.5, description="Poisson's ratio")
    edges: Edges = Field(description="how the plate is held")
    strain_limit: float = Field(
        0.05,
        gt=0,
        description="strain up to which the material comes back: yield stress over Young's modulus",
    )
    patches: tuple[PatchSection, ...] = Field(
        (), description="rectangles of another thickness or stiffness; later ones cover earlier"
    )
    tension: tuple[LineForce, LineForce, LineForce] = Field(
        (0.0, 0.0, 0.0),
        description="tension at rest along x, along y and in shear, below 0 where the plate is"
        " pressed together, N/mm",
    )
    warmer: Kelvin = Field(
        0.0,
        description="by which the plate is warmer than its rigid frame, which takes it off its"
        " tension, K",
    )
    expansion: Ratio = Field(
        7e-5, ge=0, lt=1e-2, description="thermal strain of plate less frame, 1/K [PVC]"
    )
    sag: Length = Field(
        0.0, description="height of the middle at rest, out of the touched face, mm"
    )
    warp: tuple[tuple[Length, ...], ...] = Field(
        (),
        description="height at rest by products of Legendre polynomials, a row for each degree"
        " along x from 0 and a column for each along y, mm",
    )
    taper: tuple[Taper, Taper] = Field(
        (0.0, 0.0),
        description="by which it is thicker at the edge of the larger x, and of the larger y, than"
        " in the middle, fraction; patches are even",
    )
    theory: Literal["linear", "large"] | None = Field(
        None, description="theory of deflection [the one that holds for the forces expected]"
    )

    @field_validator("warp")
    @classmethod
    def _whole(cls, warp: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
        if len({len(row) for row in warp}) > 1:
            raise PydanticCustomError("warp", "give rows of one length")
        return warp

    @model_validator(mode="after")
    def _warm_in_a_frame(self) -> PlateSection:
        """Refuse warmth where no rigid frame turns it into tension."""
        if self.warmer and give_in_plane(self.edges):
            raise PydanticCustomError(
                "scene",
                "plate.warmer is {warmer} K, and an edge gives in the plane, so that the tension"
                " does not follow from it; give plate.tension",
                {"warmer": f"{self.warmer:g}"},
            )
        return self

    @property
    def shape(self) -> fe.Shape | None:
        """Shape at rest, as `fe` knows it; None of a flat plate."""
        from fe import Shape

        return Shape(self.sag, self.warp) if self.sag or self.warp else None

    @property
    def tension_at_rest(self) -> tuple[float, float, float]:
        """Tension Nxx, Nyy, Nxy at rest with that of its warmth, N/mm."""
        xx, yy, xy = self.tension
        stretched = self.young * self.thickness * self.expansion * self.warmer / (1 - self.poisson)
        return xx - stretched, yy - stretched, xy

    def build(self) -> fe.Plate:
        """Return the plate that `fe` knows.

        Raises
        ------
        ValueError
            When the edges do not hold the plate, a patch is empty or leaves it, its shape is not
            shallow, or its taper leaves no thickness at a corner.
        """
        import fe

        return fe.Plate(
            size=self.size,
            thickness=self.thickness,
            young=self.young,
            poisson=self.poisson,
            edges=self.edges.build(),
            patches=tuple(patch.build(self) for patch in self.patches),
            tension=self.tension_at_rest,
            shape=self.shape,
            taper=self.taper,
            strain_limit=self.strain_limit,
        )


class BaseSection(Section):
    """How the clamps of the west and the east edge moved before any touch: a bent plate."""

    bend: Length = Field(0.0, ge=0, description="by which they came nearer to each other, mm")
    twist: Angle = Field(
        0.0, gt=-90, lt=90, description="by which they turned against each other about x, deg"
    )

    def build(self) -> fe.Base:
        """Return the base that `fe` knows."""
        from fe import Base

        return Base(self.bend, self.twist)


class TouchesSection(Section):
    """The touches that are expected."""

    max_touches: Count = Field(1, ge=1, le=4, description="largest number at one time")
    force: tuple[Annotated[Force, Positive], Annotated[Force, Positive]] = Field(
        description="smallest and largest force, N"
    )
    radius: Length = Field(0.0, ge=0, description="of the disc that a touch presses, mm")
    friction: Ratio = Field(
        0.0,
        ge=0,
        le=2,
        description="standard deviation of a touch's force along the face over that into the plate",
    )

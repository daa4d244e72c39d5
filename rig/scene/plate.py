"""Sections for the plate: its edges, its patches and the touches that are expected on it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from rig.scene.quantity import (
    Angle,
    AngularStiffness,
    Count,
    Force,
    Length,
    LineStiffness,
    Ratio,
    Stress,
)
from rig.scene.section import Section

if TYPE_CHECKING:
    import fe

Positive = Field(gt=0)
SIDES = ("west", "east", "south", "north")
Span = tuple[Length, Length]


class UniformSection(Section):
    """A support that is the same along the whole of what it holds."""

    @model_validator(mode="before")
    @classmethod
    def _no_sides(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return cast("object", data)
        table = cast("dict[str, Any]", data)
        side = next((side for side in SIDES if side in table), None)
        if side and "kind" in table:
            raise PydanticCustomError(
                "scene",
                "edges of kind '{kind}' are alike, so '{side}' contradicts them; set the kind to"
                " 'mixed' and give west, east, south and north a kind each",
                {"kind": table["kind"], "side": side},
            )
        return table


class ClampedSection(UniformSection):
    """Held in place and in rotation."""

    kind: Literal["clamped"] = Field(description="support")

    def build(self) -> fe.Clamped:
        """Return the support that `fe` knows."""
        import fe

        return fe.Clamped()


class SupportedSection(UniformSection):
    """Held in place, free to turn."""

    kind: Literal["supported"] = Field(description="support")

    def build(self) -> fe.Supported:
        """Return the support that `fe` knows."""
        import fe

        return fe.Supported()


class FreeSection(UniformSection):
    """Not held."""

    kind: Literal["free"] = Field(description="support")

    def build(self) -> fe.Free:
        """Return the support that `fe` knows."""
        import fe

        return fe.Free()


class ElasticSection(UniformSection):
    """Held by springs along the edge, 0 for none and inf for a rigid one."""

    kind: Literal["elastic"] = Field(description="support")
    deflection: LineStiffness = Field(
        ge=0, allow_inf_nan=True, description="force along z per length and deflection, N/mm²"
    )
    rotation: AngularStiffness = Field(
        ge=0, allow_inf_nan=True, description="moment per length and rad across the edge, N"
    )
    membrane: LineStiffness = Field(
        0.0,
        ge=0,
        allow_inf_nan=True,
        description="force in the plane per length and displacement, N/mm²",
    )

    def build(self) -> fe.Elastic:
        """Return the support that `fe` knows."""
        import fe

        return fe.Elastic(self.deflection, self.rotation, self.membrane)


Edge = Annotated[
    ClampedSection | SupportedSection | FreeSection | ElasticSection, Field(discriminator="kind")
]


class Mixed(Section):
    """Each edge held in its own way."""

    kind: Literal["mixed"] = Field(description="support")
    west: Edge = Field(description="edge at x = 0")
    east: Edge = Field(description="edge at x = a")
    south: Edge = Field(description="edge at y = 0")
    north: Edge = Field(description="edge at y = b")

    def build(self) -> fe.Edges:
        """Return the supports that `fe` knows."""
        import fe

        return fe.Edges(*(getattr(self, side).build() for side in SIDES))


Edges = Annotated[
    ClampedSection | SupportedSection | FreeSection | ElasticSection | Mixed,
    Field(discriminator="kind"),
]


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
    theory: Literal["linear", "large"] | None = Field(
        None, description="theory of deflection [the one that holds for the forces expected]"
    )

    def build(self) -> fe.Plate:
        """Return the plate that `fe` knows.

        Raises
        ------
        ValueError
            When the edges do not hold the plate, or a patch is empty or leaves it.
        """
        import fe

        return fe.Plate(
            size=self.size,
            thickness=self.thickness,
            young=self.young,
            poisson=self.poisson,
            edges=self.edges.build(),
            patches=tuple(patch.build(self) for patch in self.patches),
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

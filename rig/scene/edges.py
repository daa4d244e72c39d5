"""Sections for the edges of a plate: how each of them is held."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from rig.scene.quantity import AngularStiffness, LineStiffness, Ratio
from rig.scene.section import Section

if TYPE_CHECKING:
    import fe

SIDES = ("west", "east", "south", "north")
Taper = Annotated[Ratio, Field(gt=-1, lt=1)]


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
    taper: tuple[Taper, Taper, Taper] = Field(
        (0.0, 0.0, 0.0),
        description="by which it gives more at the end of the larger x or y than in the middle, in"
        " deflection, rotation and the plane, fraction",
    )

    def build(self) -> fe.Elastic:
        """Return the support that `fe` knows."""
        import fe

        return fe.Elastic(self.deflection, self.rotation, self.membrane, taper=self.taper)


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


def give_in_plane(edges: Edges) -> bool:
    """Whether an edge lets the plate move in its plane."""
    sides = [getattr(edges, side) for side in SIDES] if isinstance(edges, Mixed) else [edges]
    return any(
        isinstance(edge, FreeSection) or (isinstance(edge, ElasticSection) and edge.membrane < inf)
        for edge in sides
    )

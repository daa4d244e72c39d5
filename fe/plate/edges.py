"""How the edges of a plate are held: springs along their length, from none to rigid ones.

Every kind of edge says the same three numbers, so that no solver needs to know the kinds.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf, isnan
from typing import Literal, NamedTuple

from fe.plate.checks import number, short


class Springs(NamedTuple):
    """Stiffness of an edge per length; `math.inf` where the edge is held.

    Attributes
    ----------
    deflection : float, N/mm²
        Force along z per length and deflection.
    rotation : float, N
        Moment per length and slope across the edge.
    membrane : float, N/mm²
        Force in the plane per length and displacement, both ways; counts in large deflection.
    """

    deflection: float
    rotation: float
    membrane: float


@dataclass(frozen=True)
class Clamped:
    """Held in place and in rotation."""

    kind: Literal["clamped"] = "clamped"

    @property
    def springs(self) -> Springs:
        """Rigid in all three."""
        return Springs(inf, inf, inf)


@dataclass(frozen=True)
class Supported:
    """Held in place and free to turn, a hinge."""

    kind: Literal["supported"] = "supported"

    @property
    def springs(self) -> Springs:
        """Rigid but for the rotation."""
        return Springs(inf, 0.0, inf)


@dataclass(frozen=True)
class Free:
    """Not held."""

    kind: Literal["free"] = "free"

    @property
    def springs(self) -> Springs:
        """No springs."""
        return Springs(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Elastic:
    """Held by springs along the edge: a gasket, a soft clamp, a clamp that slips in the plane.

    Attributes
    ----------
    deflection, rotation, membrane : float
        See `Springs`; 0 where nothing holds, `math.inf` where the edge cannot give.

    Raises
    ------
    ValueError
        A stiffness is negative or not a number.
    """

    deflection: float
    rotation: float
    membrane: float = 0.0
    kind: Literal["elastic"] = "elastic"

    def __post_init__(self) -> None:
        for name, value, unit in zip(
            Springs._fields, self.springs, ("N/mm²", "N", "N/mm²"), strict=True
        ):
            value = number(value, f"{name} spring of an edge", unit)
            object.__setattr__(self, name, value)
            if isnan(value) or value < 0:
                raise ValueError(
                    f"{name} spring of an edge must be 0 or more, got {value:g} {unit}; "
                    "write 0 for none and inf for a rigid one"
                )

    @property
    def springs(self) -> Springs:
        """The three given."""
        return Springs(self.deflection, self.rotation, self.membrane)


Edge = Clamped | Supported | Free | Elastic
"""How one edge of a plate is held."""


@dataclass(frozen=True)
class Edges:
    """The four edges of a plate, each held in its own way.

    Attributes
    ----------
    west, east : Edge
        At x = 0 and x = a.
    south, north : Edge
        At y = 0 and y = b.

    Raises
    ------
    ValueError
        One of them is not an edge.
    """

    west: Edge
    east: Edge
    south: Edge
    north: Edge

    def __post_init__(self) -> None:
        for field in fields(self):
            check_edge(getattr(self, field.name), f"{field.name} edge")

    def along(self, axis: int) -> tuple[Edge, Edge]:
        """Edges at the start and at the end of an axis, 0 = x."""
        return ((self.west, self.east), (self.south, self.north))[axis]

    def __str__(self) -> str:
        return ", ".join(f"{field.name} {getattr(self, field.name).kind}" for field in fields(self))


def edge_of(springs: Springs) -> Edge:
    """Edge that has these springs, under its plainest name."""
    for plain in (Clamped(), Supported(), Free()):
        if plain.springs == springs:
            return plain
    return Elastic(*springs)


def check_edge(edge: object, name: str) -> None:
    """Raise unless `edge` is one of the kinds."""
    if not isinstance(edge, Clamped | Supported | Free | Elastic):
        raise ValueError(
            f"{name} must be Clamped(), Supported(), Free() or Elastic(...), got {short(edge)}"
        )


def check_held(edges: Edges) -> None:
    """Raise where nothing keeps a plate from moving or turning along z.

    An edge that is held in deflection stops the shift and the turn about its own normal; the turn
    about the edge itself needs a rotation held there or on the opposite edge, or a second edge.
    """
    carrying = 0
    for axis in (0, 1):
        springs = [edge.springs for edge in edges.along(axis)]
        carried = sum(s.deflection > 0 for s in springs)
        carrying += carried + (carried == 1 and any(s.rotation > 0 for s in springs))
    if carrying < 2:
        raise ValueError(
            f"plate edges must hold the plate, got {edges}; clamp an edge or support two"
        )

"""How the edges of a plate are held: springs along their length, from none to rigid ones.

Every kind of edge says the same three numbers, so that no solver needs to know the kinds.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf, isinf, isnan
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fe.plate.checks import array, number, short


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


EVEN = Springs(0.0, 0.0, 0.0)
"""Taper of an edge whose springs are alike along it."""


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
        See `Springs`; 0 where nothing holds, `math.inf` where the edge cannot give. In the middle
        of the edge, if there is a taper.
    taper : float or three of them
        How unevenly it gives: the compliance 1/k of a spring is (1 + taper s) times that in the
        middle, with s from -1 at the end of the smaller coordinate to 1 at the other. One number
        for all springs, or one for each in their order. A spring of 0 or inf is so all along.

    Raises
    ------
    ValueError
        A stiffness is negative or not a number, or a compliance does not stay positive.
    """

    deflection: float
    rotation: float
    membrane: float = 0.0
    kind: Literal["elastic"] = "elastic"
    taper: float | tuple[float, float, float] = EVEN

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
        object.__setattr__(self, "taper", _taper(self.taper))

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


def taper_of(edge: Edge) -> Springs:
    """How unevenly each spring of an edge gives, see `Elastic`; 0 where it is none or rigid."""
    if not isinstance(edge, Elastic):
        return EVEN
    each = zip(edge.springs, _taper(edge.taper), strict=True)
    return Springs(*(0.0 if spring == 0 or isinf(spring) else taper for spring, taper in each))


def part_of(edge: Edge, low: float, high: float) -> Edge:
    """Edge along a part of an edge, from s = low to high of -1 to 1.

    A compliance that is linear along the whole is so along the part.
    """
    if not isinstance(edge, Elastic):
        return edge
    middle, half, taper = 0.5 * (low + high), 0.5 * (high - low), taper_of(edge)
    there = [1.0 + t * middle for t in taper]
    deflection, rotation, membrane = (k / c for k, c in zip(edge.springs, there, strict=True))
    tapers = Springs(*(t * half / c for t, c in zip(taper, there, strict=True)))
    return Elastic(deflection, rotation, membrane, taper=tapers)


def edge_of(springs: Springs, taper: Springs = EVEN) -> Edge:
    """Edge that has these springs, under its plainest name."""
    for plain in (Clamped(), Supported(), Free()):
        if plain.springs == springs:
            return plain
    return Elastic(*springs, taper=taper)


def _taper(given: ArrayLike) -> Springs:
    """Three tapers of one number or of three, each checked."""
    values = array(given, "taper of an edge", "parts of 1")
    if values.shape not in ((1,), (len(Springs._fields),)):
        raise ValueError(
            f"taper of an edge must be one number or three, got {short(given)}; give those of "
            "deflection, rotation and membrane"
        )
    tapers = Springs(*np.broadcast_to(values, len(Springs._fields)).tolist())
    for name, taper in zip(Springs._fields, tapers, strict=True):
        if not abs(taper) < 1.0:
            raise ValueError(
                f"taper of the {name} spring must lie between -1 and 1, where its compliance stays "
                f"positive along the edge, got {taper:g}"
            )
    return tapers


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

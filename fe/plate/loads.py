"""What acts on a plate beside touches: pressure, forces along lines and along the face, moments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TypeAlias

from fe.plate.checks import number
from fe.plate.plate import Touch


@dataclass(frozen=True)
class Pressure:
    """Even pressure on the whole plate, or on a rectangle of it.

    Attributes
    ----------
    pressure : float, MPa
        Positive into the plate.
    x, y : tuple of float, mm, or None
        From and to along each side; None for the whole side.

    Raises
    ------
    ValueError
        A number is not finite, or the rectangle is empty.
    """

    pressure: float
    x: tuple[float, float] | None = None
    y: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        _all_finite(self, "", "MPa", "pressure")
        for name, ends in (("x", self.x), ("y", self.y)):
            if ends is not None and not ends[0] < ends[1]:
                raise ValueError(
                    f"pressure must act from a smaller to a larger {name}, got {ends[0]:g} to"
                    f" {ends[1]:g} mm; exchange them"
                )


@dataclass(frozen=True)
class LineLoad:
    """A force spread evenly along a line on the touched face.

    Attributes
    ----------
    start, end : tuple of float, mm
        Ends (x, y) of the line.
    force : float, N
        Of the whole line, positive into the plate.
    along_x, along_y : float, N
        Of the whole line, along the face.

    Raises
    ------
    ValueError
        A number is not finite, or the line is a point.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    force: float
    along_x: float = 0.0
    along_y: float = 0.0

    def __post_init__(self) -> None:
        _all_finite(self, "line load ", "N", "force", "along_x", "along_y")
        if tuple(self.start) == tuple(self.end):
            raise ValueError(
                f"line load must have a length, got both ends at {self.start} mm; use a Touch"
            )


@dataclass(frozen=True)
class FaceForce:
    """A force along the touched face at a point, such as friction of a finger.

    Attributes
    ----------
    x, y : float, mm
    along_x, along_y : float, N

    Raises
    ------
    ValueError
        A number is not finite.
    """

    x: float
    y: float
    along_x: float
    along_y: float

    def __post_init__(self) -> None:
        _all_finite(self, "face force ", "N", "along_x", "along_y")


@dataclass(frozen=True)
class PointMoment:
    """A moment at a point, by the right hand about the axes of the plate.

    Attributes
    ----------
    x, y : float, mm
    about_x, about_y : float, N mm

    Raises
    ------
    ValueError
        A number is not finite.
    """

    x: float
    y: float
    about_x: float
    about_y: float

    def __post_init__(self) -> None:
        _all_finite(self, "point moment ", "N mm", "about_x", "about_y")


Load: TypeAlias = Pressure | LineLoad | FaceForce | PointMoment
"""What acts on a plate beside touches."""


def acts_along(load: Load) -> bool:
    """Whether a load has a part along the face, which stretches the plate in its plane."""
    return isinstance(load, FaceForce | LineLoad) and (load.along_x != 0 or load.along_y != 0)


def steep_places(loads: Sequence[Load], size: tuple[float, float]) -> tuple[Touch, ...]:
    """Points near which the strain under the loads changes fast, as touches without force.

    Those at which it has no limit, ends of lines and corners of rectangles.
    """
    ends = [end for load in loads for end in _ends(load, size)]
    return (*singular_places(loads), *(Touch(*end, 0.0) for end in ends))


def _ends(load: Load, size: tuple[float, float]) -> tuple[tuple[float, float], ...]:
    """Return the ends of a line, or two opposite corners of a rectangle; none of a point."""
    match load:
        case LineLoad():
            return load.start, load.end
        case Pressure():
            x, y = load.x or (0.0, size[0]), load.y or (0.0, size[1])
            return (x[0], y[0]), (x[1], y[1])
        case _:
            return ()


def singular_places(loads: Sequence[Load]) -> tuple[Touch, ...]:
    """Points at which the strain under the loads has no limit, as touches without force."""
    return tuple(
        Touch(load.x, load.y, 0.0) for load in loads if isinstance(load, FaceForce | PointMoment)
    )


def _all_finite(load: Load, kind: str, unit: str, *names: str) -> None:
    for name in names:
        shown = f"{kind}{name}"
        given = number(getattr(load, name), shown, unit)
        if not isfinite(given):
            raise ValueError(f"{shown} must be finite, got {given} {unit}; give a number")

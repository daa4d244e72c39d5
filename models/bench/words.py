"""What a number of a bench means on the bench: which clamp, how many millimetres, how warm."""

from __future__ import annotations

from math import degrees, expm1

import fe

EXPANSION = 7e-5  # 1/K, of PVC, by which tension is stated as a temperature


def in_words(name: str, value: float, plate: fe.Plate) -> str:
    """State by how much a number of a bench is otherwise than described.

    A clamp that gives is stated by the length of plate that gives as much.

    Parameters
    ----------
    name : str
        One of `BENCH`.
    value : float
        In the unit of `BENCH`, beside what is described.
    plate : fe.Plate
        As described.
    """
    kind, _, rest = name.partition("_")
    match kind:
        case "rotation" | "membrane":
            return _clamp(kind, rest, value, plate)
        case "tension":
            return _tension(rest, value, plate)
        case "sag":
            return f"{value:+.2g} mm of {_shape('sag', rest)}"
        case "thickness":
            return f"{expm1(value):+.2%} of {_shape('thickness', rest)}"
        case "turn":
            return f"turned by {degrees(value):+.2f}° about {rest}"
        case "shift":
            return f"{value:+.2g} mm along {rest}"
        case "focal" | "young":
            return f"{expm1(value):+.2%}"
        case _:
            return f"{name} {value:+.3g}"


def _clamp(kind: str, edge: str, value: float, plate: fe.Plate) -> str:
    side, _, slope = edge.partition("_")
    a, b = plate.size
    at = {"west": "x = 0", "east": f"x = {a:g} mm", "south": "y = 0", "north": f"y = {b:g} mm"}
    stiff, way = plate.young * plate.thickness, "in the plane"
    if kind == "rotation":
        stiff, way = plate.rigidity, "in rotation"
    more = "more" if value > 0 else "less"
    ends = " at one end than at the other" if slope else ""
    return (
        f"the clamp at {at[side]} gives {way}, {more}{ends} by what"
        f" {abs(value) * stiff:.2g} mm of plate do"
    )


def _tension(along: str, value: float, plate: fe.Plate) -> str:
    if along == "xy":
        return f"{value:+.2g} N/mm of shear"
    kelvin = value * (1.0 - plate.poisson) / (plate.young * plate.thickness * EXPANSION)
    warmth = "warmer" if kelvin < 0 else "colder"
    return (
        f"{value:+.2g} N/mm along {along[0]}, as if {abs(kelvin):.2g} K {warmth} than its frame in"
        " PVC"
    )


def _shape(what: str, degrees_along: str) -> str:
    return f"{what} by the polynomial {degrees_along}" if degrees_along else what

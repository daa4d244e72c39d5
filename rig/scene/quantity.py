"""Numbers with a unit: what a scene file may write, and what the code below it gets."""

import re
from dataclasses import dataclass
from math import degrees
from typing import Annotated, Any

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

UNITS: dict[str, dict[str, float]] = {
    "mm": {"m": 1e3, "cm": 10.0, "mm": 1.0, "um": 1e-3, "µm": 1e-3, "in": 25.4},
    "MPa": {"GPa": 1e3, "MPa": 1.0, "N/mm2": 1.0, "N/mm²": 1.0, "kPa": 1e-3, "Pa": 1e-6},
    "N": {"kN": 1e3, "N": 1.0, "mN": 1e-3},
    "N/mm²": {"N/mm²": 1.0, "N/mm2": 1.0, "N/m²": 1e-6, "N/m2": 1e-6},
    "deg": {"deg": 1.0, "°": 1.0, "rad": degrees(1.0)},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6},
    "K": {"K": 1.0},
    "fps": {"fps": 1.0, "Hz": 1.0},
    "px": {"px": 1.0},
    "grey levels": {"grey levels": 1.0},
    "": {},
}
"""For each unit of the code, the units a file may use instead and their factors."""

_WRITTEN = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*?)?\s*")


@dataclass(frozen=True)
class Quantity:
    """Reads a number in `unit`, or a text such as "2 cm", and gives the number in `unit`."""

    unit: str

    def __call__(self, value: Any) -> Any:
        """Return the number in `unit`; what is no text is left to the type of the field."""
        if isinstance(value, bool):
            raise self._refusal()
        if not isinstance(value, str):
            return value
        written = _WRITTEN.fullmatch(value)
        if written is None:
            raise self._refusal()
        number, unit = written.groups()
        if unit is None:
            return float(number)
        if unit not in UNITS[self.unit]:
            raise self._refusal()
        return float(number) * UNITS[self.unit][unit]

    def wanted(self) -> str:
        """Say what may be written here."""
        if not self.unit:
            return "a plain number without a unit"
        others = [unit for unit in UNITS[self.unit] if unit != self.unit]
        tail = f" or a text with its unit ({', '.join(others)})" if others else ""
        return f"a number in {self.unit}{tail}"

    def _refusal(self) -> PydanticCustomError:
        return PydanticCustomError("quantity", "give {wanted}", {"wanted": self.wanted()})


Length = Annotated[float, BeforeValidator(Quantity("mm"))]
Stress = Annotated[float, BeforeValidator(Quantity("MPa"))]
Force = Annotated[float, BeforeValidator(Quantity("N"))]
LineStiffness = Annotated[float, BeforeValidator(Quantity("N/mm²"))]
Angle = Annotated[float, BeforeValidator(Quantity("deg"))]
Time = Annotated[float, BeforeValidator(Quantity("s"))]
Kelvin = Annotated[float, BeforeValidator(Quantity("K"))]
Rate = Annotated[float, BeforeValidator(Quantity("fps"))]
Pixels = Annotated[float, BeforeValidator(Quantity("px"))]
Grey = Annotated[float, BeforeValidator(Quantity("grey levels"))]
Ratio = Annotated[float, BeforeValidator(Quantity(""))]
Count = Annotated[int, Field(strict=True)]


def odd(value: int) -> int:
    """Refuse an even number, for the side of a window that has a middle."""
    if value % 2 == 0:
        raise PydanticCustomError("odd", "give an odd number such as {near}", {"near": value + 1})
    return value

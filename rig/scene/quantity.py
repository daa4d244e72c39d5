"""Numbers with a unit: what a scene file may write, and what the code below it gets."""

import re
from dataclasses import dataclass
from math import degrees, inf, isfinite
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field
from pydantic_core import PydanticCustomError

UNITS: dict[str, dict[str, float]] = {
    "mm": {"m": 1e3, "cm": 10.0, "mm": 1.0, "um": 1e-3, "µm": 1e-3, "in": 25.4},
    "MPa": {"GPa": 1e3, "MPa": 1.0, "N/mm2": 1.0, "N/mm²": 1.0, "kPa": 1e-3, "Pa": 1e-6},
    "N": {"kN": 1e3, "N": 1.0, "mN": 1e-3},
    "N/mm": {"N/mm": 1.0, "N/m": 1e-3},
    "N/mm²": {"N/mm²": 1.0, "N/mm2": 1.0, "N/m²": 1e-6, "N/m2": 1e-6},
    "deg": {"deg": 1.0, "°": 1.0, "rad": degrees(1.0)},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6},
    "mm/s": {"mm/s": 1.0, "um/s": 1e-3, "µm/s": 1e-3, "mm/min": 1.0 / 60.0},
    "deg/s": {"deg/s": 1.0, "°/s": 1.0, "deg/min": 1.0 / 60.0},
    "K": {"K": 1.0},
    "fps": {"fps": 1.0, "Hz": 1.0},
    "px": {"px": 1.0},
    "grey levels": {"grey levels": 1.0},
    "kg/m³": {"kg/m³": 1.0, "kg/m3": 1.0, "g/cm³": 1e3, "g/cm3": 1e3},
    "": {},
}
"""For each unit of the code, the units a file may use instead and their factors."""

_WRITTEN = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*?)?\s*")


@dataclass(frozen=True)
class Quantity:
    """Reads a number in `unit`, or a text such as "2 cm", and gives the number in `unit`.

    Attributes
    ----------
    unit : str
    largest, smallest : float
        Beyond these sizes no bench has such a quantity: a slip of the pen, or a damaged file. Zero
        and infinity are left to the type of the field.
    """

    unit: str
    largest: float = inf
    smallest: float = 0.0

    def __call__(self, value: Any) -> Any:
        """Return the number in `unit`; what is neither text nor number is left to the field."""
        if isinstance(value, bool):
            raise self._refusal()
        number = self._number(value) if isinstance(value, str) else value
        return self._of_usual_size(number) if isinstance(number, int | float) else number

    def _of_usual_size(self, number: float) -> float:
        if isinstance(number, float) and not isfinite(number):
            return number
        if abs(number) > self.largest:
            raise self._other_size(f"at most {self.largest:g} {self.unit}")
        if 0 < abs(number) < self.smallest:
            raise self._other_size(f"0 or at least {self.smallest:g} {self.unit}")
        return number

    def _other_size(self, wanted: str) -> PydanticCustomError:
        return PydanticCustomError("quantity", "give {wanted}", {"wanted": wanted.strip()})

    def _number(self, value: str) -> float:
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


Length = Annotated[float, BeforeValidator(Quantity("mm", 1e6, 1e-6))]
Stress = Annotated[float, BeforeValidator(Quantity("MPa", 1e8, 1e-6))]
Force = Annotated[float, BeforeValidator(Quantity("N", 1e6, 1e-9))]
LineForce = Annotated[float, BeforeValidator(Quantity("N/mm", 1e6))]
LineStiffness = Annotated[float, BeforeValidator(Quantity("N/mm²", 1e12))]
"""That of a rigid support is infinite."""
AngularStiffness = Annotated[float, BeforeValidator(Quantity("N", 1e12))]
"""Moment per length and rad; that of a rigid support is infinite."""
Angle = Annotated[float, BeforeValidator(Quantity("deg", 360.0))]
Speed = Annotated[float, BeforeValidator(Quantity("mm/s", 1e4))]
TurningSpeed = Annotated[float, BeforeValidator(Quantity("deg/s", 1e4))]
Time = Annotated[float, BeforeValidator(Quantity("s", 1e6, 1e-9))]
Density = Annotated[float, BeforeValidator(Quantity("kg/m³", 1e5, 1.0))]
Kelvin = Annotated[float, BeforeValidator(Quantity("K", 1e5))]
Rate = Annotated[float, BeforeValidator(Quantity("fps", 1e5, 1e-4))]
Pixels = Annotated[float, BeforeValidator(Quantity("px", 1e5))]
Grey = Annotated[float, BeforeValidator(Quantity("grey levels", 65535.0))]
Ratio = Annotated[float, BeforeValidator(Quantity("", 1e6))]
LARGEST_SIDE = 20_000
"""Of an image, px."""


def _countable(value: int) -> int:
    """Refuse a number of which no machine has so many."""
    if abs(value) > MANY:
        raise PydanticCustomError("count", "give at most {most}", {"most": f"{MANY:g}"})
    return value


MANY = 10**12
Count = Annotated[int, Field(strict=True), AfterValidator(_countable)]


def odd(value: int) -> int:
    """Refuse an even number, for the side of a window that has a middle."""
    if value % 2 == 0:
        raise PydanticCustomError("odd", "give an odd number such as {near}", {"near": value + 1})
    return value

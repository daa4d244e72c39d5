"""What a person says of a bench that is to be set up, checked value by value."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field, ValidationError
from pydantic_core import PydanticCustomError

from rig.scene.bench import Side
from rig.scene.loop import Index
from rig.scene.quantity import Force, Length, Rate, Time
from rig.scene.refusal import SceneError, sentence
from rig.scene.section import Section

Edges = Literal["clamped", "supported", "two clamped"]
GRAM = 9.80665e-3  # N


@dataclass(frozen=True)
class Material:
    """Young's modulus, MPa; Poisson's ratio; strain up to which it comes back."""

    young: float
    poisson: float
    strain_limit: float


MATERIALS = {
    "PVC": Material(3000.0, 0.38, 0.017),
    "acrylic": Material(3200.0, 0.37, 0.02),
    "polycarbonate": Material(2350.0, 0.38, 0.025),
    "glass": Material(70_000.0, 0.22, 0.0005),
    "aluminium": Material(70_000.0, 0.33, 0.003),
    "steel": Material(205_000.0, 0.29, 0.0015),
}
"""Usual values of handbooks; presses of a known weight correct the modulus."""


def _sides(value: Any) -> Any:
    """Read "1280 x 960"."""
    if isinstance(value, str):
        numbers = re.fullmatch(r"\s*(\d+)\s*[x×*, ]\s*(\d+)\s*(?:px)?\s*", value)
        if numbers is None:
            raise PydanticCustomError("pixels", "give width and height in px, such as 1280 x 960")
        return tuple(int(number) for number in numbers.groups())
    return value


Pixels = Annotated[tuple[Side, Side], BeforeValidator(_sides)]


class Answers(Section):
    """A bench as its owner describes it."""

    width: Length = Field(254.0, gt=0, description="side of the plate along x, mm")
    height: Length = Field(203.0, gt=0, description="side of the plate along y, mm")
    thickness: Length = Field(2.0, gt=0, description="thickness, mm, measured at several places")
    material: Literal["PVC", "acrylic", "polycarbonate", "glass", "aluminium", "steel"] = Field(
        "PVC", description="material"
    )
    edges: Edges = Field("clamped", description="how the plate is held along its edges")
    stand_off: Length = Field(500.0, gt=0, description="distance of the camera, mm")
    side: Literal["above", "below"] = Field(
        "above", description="side of the plate that the camera stands on; fingers press from above"
    )
    pixels: Pixels = Field((1280, 960), description="width and height of an image, px")
    rate: Rate = Field(30.0, gt=0, description="images a second, fps")
    force: Force = Field(3.0, gt=0, description="largest force of a finger, N")
    projector: Literal["yes", "no"] = Field("yes", description="whether a projector lights it")
    camera: Annotated[str, Field(min_length=1)] | None = Field(
        None,
        description="device node of the camera; or its kind before it, with a serial number: basler"
        " 12345678, genicam 1234 maker.cti, v4l2 /dev/video0",
    )
    exposure: Annotated[Time, Field(gt=0, le=1)] | None = Field(
        None, description="exposure, such as 8 ms"
    )
    output: Annotated[str, Field(min_length=1)] | Index | None = Field(
        None, description="output of the desktop that the projector is"
    )
    screen: Pixels = Field((1280, 800), description="width and height of that output, px")
    ruler: Length = Field(100.0, gt=50, lt=200, description="100 mm of the ruler as printed, mm")
    left: Length | None = Field(None, description="board's left edge right of the plate's, mm")
    below: Length | None = Field(None, description="board's lower edge above the plate's, mm")
    grams: float = Field(200.0, ge=0.1, le=20_000, description="known weight, g")

    @property
    def size(self) -> tuple[float, float]:
        """Sides of the plate, mm."""
        return self.width, self.height

    @property
    def weight(self) -> float:
        """Of what is laid on the plate, N."""
        return GRAM * self.grams


NOTHING_SAID = Answers.model_validate({})
"""What holds until it is said otherwise."""


def with_answer(answers: Answers, key: str, text: str) -> Answers:
    """Put one answer in the place of the old one.

    Raises
    ------
    SceneError
        If there is no such question, or the text is no answer to it.
    """
    if key not in Answers.model_fields:
        raise SceneError(f"there is no question '{key}'; leave it out")
    value: Any = text.strip()
    if not value and type(None) in get_args(Answers.model_fields[key].annotation):
        value = None
    elif key == "output" and value.isdecimal():
        value = int(value)
    try:
        return Answers.model_validate(answers.model_dump() | {key: value})
    except ValidationError as error:
        raise SceneError(sentence(error, Answers)) from error


def text_of(answers: Answers, key: str) -> str:
    """Write an answer as a person would."""
    value = getattr(answers, key)
    match value:
        case None:
            return ""
        case float() if key == "exposure":
            return f"{1e3 * value:.6g} ms"
        case (width, height):
            return f"{width} x {height}"
        case float():
            return f"{value:.6g}"
        case _:
            return str(value)

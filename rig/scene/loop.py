"""Sections for what the live loop is connected to: source of pictures, page, projector."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from rig.scene.quantity import Count, Pixels
from rig.scene.section import Section


class Twin(Section):
    """The digital twin: pictures are rendered, so the truth is known."""

    kind: Literal["twin"] = Field("twin", description="where pictures come from")
    script: Literal["tour", "random", "collect", "empty"] = Field(
        "tour",
        description="touches: a tour of moves and presses, single random ones, known ones, or none",
    )
    seed: Count = Field(0, ge=0, description="seed of noise and random touches")
    shift: tuple[Pixels, Pixels] = Field(
        (0.0, 0.0), description="shift of the camera after the reference, x and y, px"
    )


class Page(Section):
    """The operator page on a loopback address."""

    port: Count = Field(8765, ge=0, le=65535, description="port, 0 for any free one")


class Projector(Section):
    """The window that shows the touches on the plate."""

    display: str = Field(":0", min_length=1, description="name of the X display")
    size: tuple[Annotated[Count, Field(ge=1)], Annotated[Count, Field(ge=1)]] = Field(
        (1280, 800), description="width and height of its picture, px"
    )
    full_screen: bool = Field(True, strict=True, description="whether it fills the display")

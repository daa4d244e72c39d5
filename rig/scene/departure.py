"""Section for how the bench of the twin differs from its scene: each thing by its size."""

from __future__ import annotations

from math import inf
from typing import Annotated

from pydantic import Field

from rig.scene.quantity import (
    Angle,
    AngularStiffness,
    Kelvin,
    Length,
    LineForce,
    LineStiffness,
    Pixels,
    Ratio,
    Time,
)
from rig.scene.section import Section

Little = Annotated[Ratio, Field(gt=-0.5, lt=0.5)]


class GivingSection(Section):
    """An edge that gives where the scene has it clamped."""

    rotation: AngularStiffness = Field(
        inf, gt=0, allow_inf_nan=True, description="moment per length and rad across the edge, N"
    )
    membrane: LineStiffness = Field(
        inf,
        gt=0,
        allow_inf_nan=True,
        description="force in the plane per length and displacement, N/mm²",
    )


class DepartureSection(Section):
    """How the twin's bench really is; the estimator knows none of it."""

    young: Little = Field(0.0, description="Young's modulus, fraction above the scene's")
    thickness: Little = Field(0.0, description="thickness, fraction above the scene's")
    uneven: Little = Field(0.0, description="by which the half at x > a/2 is thicker, fraction")
    sag: Length = Field(
        0.0, description="height of the middle over the scene's, out of the touched face, mm"
    )
    tension: tuple[LineForce, LineForce] = Field(
        (0.0, 0.0), description="tension at rest along x and y beyond the scene's, N/mm"
    )
    warmer: Kelvin = Field(0.0, description="by which the plate is warmer yet than its frame, K")
    expansion: Ratio = Field(
        7e-5, ge=0, lt=1e-2, description="thermal strain of plate less frame, 1/K [PVC]"
    )
    west: GivingSection | None = Field(None, description="edge at x = 0 [as in the scene]")
    east: GivingSection | None = Field(None, description="edge at x = a [as in the scene]")
    south: GivingSection | None = Field(None, description="edge at y = 0 [as in the scene]")
    north: GivingSection | None = Field(None, description="edge at y = b [as in the scene]")
    leftover: Ratio = Field(
        0.0, ge=0, lt=0.5, description="fraction of a touch that the plate shows when it has ended"
    )
    fading: Time = Field(20.0, gt=0, description="in which that falls to 1/e, s")
    creep: Ratio = Field(
        0.0,
        ge=0,
        lt=0.5,
        description="fraction by which the plate gives more at last under a touch that is held in"
        " its place; as fast as what is left fades",
    )
    pad: Length = Field(0.0, ge=0, description="radius of a finger, mm [as in the scene]")
    turned: tuple[Angle, Angle, Angle] = Field(
        (0.0, 0.0, 0.0), description="turn of the plate under the camera about x, y and z, deg"
    )
    moved: tuple[Length, Length, Length] = Field(
        (0.0, 0.0, 0.0), description="shift of the plate under the camera along x, y and z, mm"
    )
    focal: Little = Field(0.0, description="focal length, fraction above the scene's")
    k1: Ratio = Field(0.0, gt=-1, lt=1, description="first coefficient of radial distortion")
    k2: Ratio = Field(0.0, gt=-1, lt=1, description="second coefficient of radial distortion")
    drift: tuple[Pixels, Pixels] = Field(
        (0.0, 0.0), description="motion of the camera in a minute, x and y, px"
    )
    tilting: tuple[Angle, Angle] = Field(
        (0.0, 0.0),
        description="turn of the plate under the camera in a minute, about x and y, deg",
    )
    gamma: Ratio = Field(
        1.0, ge=0.2, le=5, description="grey levels are the light to the power of 1/gamma"
    )
    vignetting: Ratio = Field(
        0.0, ge=0, lt=0.9, description="fraction of the light that the corners of the image lack"
    )
    brighter: Little = Field(
        0.0, description="fraction by which the light has grown since the reference was taken"
    )
    shadow: Ratio = Field(
        0.0, ge=0, lt=0.95, description="fraction of the light that a shadow takes which wanders"
    )
    flicker: Ratio = Field(
        0.0, ge=0, lt=0.3, description="standard deviation of the light from frame to frame"
    )
    defocus: Pixels = Field(
        0.0, ge=0, le=20, description="blur since the reference was taken, standard deviation, px"
    )
    hand: Length = Field(
        0.0, ge=0, description="width of the arm that is seen of whoever presses, mm"
    )
    clamps: Ratio = Field(
        0.0, ge=0, le=10, description="light of what is seen beside the plate, 1 as its ground"
    )
    fixed_pattern: Ratio = Field(
        0.0, ge=0, lt=50, description="what each pixel adds to every frame, grey levels"
    )

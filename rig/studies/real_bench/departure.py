"""Benches that differ from their scene, one thing at a time and all together."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf, radians

import fe
from rig.sources.surroundings import Surroundings

SCENE = """
title = "A bench that is not quite as it is said"

[plate]
size = ["254 mm", "254 mm"]
thickness = "{thickness} mm"
young = "3 GPa"
poisson = 0.38
{edges}

[touches]
max_touches = 2
force = ["0.5 N", "4 N"]

[camera]
kind = "pinhole"
pixels = [1024, 1024]
stand_off = "500 mm"
rate = "30 fps"
side = "{side}"
row_time = "{row_time} µs"

[source]
kind = "folder"
path = "{folder}"

[dic]
tile = 16
subset = 49
window = 5
reference_frames = 16

[estimator]
kind = "pattern"
bench = "usual"
"""
"""What is said of every one of them, but for the thickness and the edges."""

CLAMPED = 'edges.kind = "clamped"'
TWO_CLAMPED = """edges.kind = "mixed"
edges.west.kind = "clamped"
edges.east.kind = "clamped"
edges.south.kind = "free"
edges.north.kind = "free"
"""

SAID = fe.Plate((254.0, 254.0), 1.0, 3000.0, 0.38)
_HEAT = SAID.young * SAID.thickness * 7e-5 / (1.0 - SAID.poisson)  # N/mm for each kelvin, PVC


@dataclass(frozen=True)
class RealBench:
    """What a bench really is.

    Attributes
    ----------
    plate : fe.Plate
    camera : tuple of 9 float
        See `models.CAMERA`.
    moved : tuple of 9 float
        Change of the camera after the reference was taken.
    leftover : float
        Fraction of the last touch that the plate still shows.
    gamma : float
        Of the camera: grey levels are the light to the power of 1 / gamma.
    below : bool
        Whether the camera looks at the underside.
    rolling : float
        Change of the force while an image is read, a fraction of it, one way or the other; 0 for a
        global shutter.
    pad : float, mm
        Radius of the finger; the scene's touches are points.
    surroundings : Surroundings
        Light, lens, hand and dirt.
    full_well : float or None, electrons
        Of the span of the grey levels; None for a camera without shot noise.
    said_thickness : float, mm
        As the scene has it.
    said_edges : str
        Lines of the scene.
    """

    plate: fe.Plate = SAID
    camera: tuple[float, ...] = (0.0,) * 9
    moved: tuple[float, ...] = (0.0,) * 9
    leftover: float = 0.0
    gamma: float = 1.0
    below: bool = False
    rolling: float = 0.0
    pad: float = 0.0
    surroundings: Surroundings = field(default_factory=Surroundings)
    full_well: float | None = None
    said_thickness: float = SAID.thickness
    said_edges: str = CLAMPED


def _held(*sides: tuple[float, float]) -> fe.Plate:
    """Return the plate with edges that give: springs of rotation and in the plane for each."""
    return replace(SAID, edges=fe.Edges(*(fe.Elastic(inf, *each) for each in sides)))


def _heated(kelvin: float) -> fe.Plate:
    return replace(SAID, tension=(-_HEAT * kelvin, -_HEAT * kelvin, 0.0))


_RIGID = (inf, inf)
_GIVING = ((2000.0, 60.0), (1500.0, 80.0), (3000.0, 50.0), (1800.0, 70.0))
_POSE = (radians(0.6), radians(-0.7), 0.0, 1.1, -0.8, 1.5, 0.006, -0.03, 0.0)

ALL = RealBench(
    replace(
        _held(*_GIVING),
        young=2760.0,
        thickness=0.97,
        shape=fe.Shape(sag=0.2),
        tension=(0.06, 0.1, 0.0),
    ),
    camera=_POSE,
)
"""Everything at once, but for what changes while it is used."""

DEPARTURES: dict[str, RealBench] = {
    "nothing": RealBench(),
    "young -10 %": RealBench(replace(SAID, young=2700.0)),
    "thickness -3 %": RealBench(replace(SAID, thickness=0.97)),
    "clamps that give": RealBench(_held(*_GIVING)),
    "one soft clamp": RealBench(_held((400.0, 25.0), _RIGID, _RIGID, _RIGID)),
    "sag 0.05 mm": RealBench(replace(SAID, shape=fe.Shape(sag=0.05))),
    "sag 0.3 mm": RealBench(replace(SAID, shape=fe.Shape(sag=0.3))),
    "0.1 K warmer": RealBench(_heated(0.1)),
    "0.5 K warmer": RealBench(_heated(0.5)),
    "half of it 5 % thicker": RealBench(
        replace(SAID, patches=(fe.Patch((127.0, 254.0), (0.0, 254.0), 1.05, SAID.young),))
    ),
    "creep 5 %": RealBench(leftover=0.05),
    "pose 1°, 2 mm": RealBench(camera=(radians(1.0), 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
    "focal length +2 %": RealBench(camera=(0.0,) * 6 + (0.02, 0.0, 0.0)),
    "k1 -0.08": RealBench(camera=(0.0,) * 7 + (-0.08, 0.0)),
    "camera drifts by 1 px": RealBench(moved=(2e-4, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0)),
}
"""Each thing alone, by its name."""

SURROUNDED: dict[str, RealBench] = {
    "20 % brighter": RealBench(surroundings=Surroundings(brighter=0.2)),
    "shadow of 40 %": RealBench(surroundings=Surroundings(shadow=0.4)),
    "flicker of 3 %": RealBench(surroundings=Surroundings(flicker=0.03)),
    "defocus of 1 px": RealBench(surroundings=Surroundings(defocus=1.0)),
    "vignetting of 30 %": RealBench(surroundings=Surroundings(vignetting=0.3)),
    "finger pad of 5.5 mm": RealBench(pad=5.5),
    "a hand of 60 mm": RealBench(surroundings=Surroundings(hand=60.0)),
    "bright clamps": RealBench(surroundings=Surroundings(clamps=2.0)),
    "shot noise of 4000 electrons": RealBench(full_well=4000.0),
    "fixed pattern of 3 grey levels": RealBench(surroundings=Surroundings(fixed_pattern=3.0)),
}
"""What lies between the plate and its image, and the finger, each alone."""

_TWO_GIVING = fe.Edges(
    fe.Elastic(inf, 2000.0, 60.0), fe.Elastic(inf, 1500.0, 80.0), fe.Free(), fe.Free()
)

READOUT = 0.9
"""Of an image whose rows are read one after the other, in parts of the time of a frame."""
_CHANGE = 0.1  # of the force in a frame

BENCHES: dict[str, RealBench] = {
    "gamma 2.2": RealBench(gamma=2.2),
    "rolling shutter": RealBench(rolling=_CHANGE * READOUT),
    "rolling shutter, all wrong": replace(ALL, rolling=_CHANGE * READOUT),
    "camera below": RealBench(below=True),
    "camera below, all wrong": replace(ALL, below=True),
    "all wrong, creep, drift and gamma too": replace(
        ALL, leftover=0.05, gamma=2.2, moved=DEPARTURES["camera drifts by 1 px"].moved
    ),
    "plate of 2 mm": replace(ALL, plate=replace(ALL.plate, thickness=1.94), said_thickness=2.0),
    "two edges clamped": replace(
        ALL,
        plate=replace(ALL.plate, edges=_TWO_GIVING, tension=(0.06, 0.0, 0.0), shape=None),
        said_edges=TWO_CLAMPED,
    ),
}
"""Other benches: a camera whose grey levels bend, and others on which all is wrong together."""

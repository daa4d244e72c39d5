"""What a design is made from, the sections of a scene, and what can be changed in them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rig.scene import Scene
from rig.scene.bench import CameraSection, PatternSection, SensorSection
from rig.scene.plate import PlateSection
from rig.scene.sensing import DicSection

STEP = 1.25  # by which a change changes something, unless it says otherwise
AVERAGED = 4  # frames
ROUNDING = 1 / 12  # variance of rounding to whole grey levels


@dataclass(frozen=True)
class Setup:
    """The sections of a scene that a design is made from, all of them there."""

    plate: PlateSection
    camera: CameraSection
    pattern: PatternSection
    sensor: SensorSection
    dic: DicSection
    frames: int = 1  # averaged before touches are sought

    @property
    def noise(self) -> float:
        """Noise of the mean of frames less the reference, grey levels."""
        variance = 1 / self.frames + 1 / self.dic.reference_frames
        return self.perfect_noise * float(np.sqrt(variance))

    @property
    def perfect_noise(self) -> float:
        """Noise of a frame against a reference without any, grey levels."""
        return float(np.sqrt(self.sensor.noise**2 + ROUNDING))

    @property
    def geometry(self) -> tuple[PlateSection, CameraSection, int]:
        """What decides how touches are seen, whatever the pattern and the noise."""
        return self.plate, self.camera, self.tile

    @property
    def tile(self) -> int:
        """Side of a tile, px; of large images no more than 64 tiles a side are needed."""
        return max(self.dic.tile, max(self.camera.pixels) // 64)


Row = tuple[str, str, str, Setup]
"""A change: what, before, after, and the setup after it."""


def setup_of(scene: Scene) -> Setup:
    """Return what a design is made from.

    Raises
    ------
    ValueError
        If the scene lacks a part, or its plate is bent before it is touched.
    """
    match scene:
        case Scene(
            plate=PlateSection() as plate,
            camera=CameraSection() as camera,
            pattern=PatternSection() as pattern,
            sensor=SensorSection() as sensor,
            dic=DicSection() as dic,
        ) if scene.base is None:
            return Setup(plate, camera, pattern, sensor, dic)
        case _:
            pass
    if scene.base is not None:
        raise ValueError(
            f"scene '{scene.title}' has a bent plate, and a design takes it as flat; leave [base]"
            " out"
        )
    raise ValueError(
        f"scene '{scene.title}' cannot be designed; it needs [plate], [camera], [pattern], [sensor]"
        " and [dic], as twin has them"
    )


def changes(given: Setup) -> Iterator[Row]:
    """List changes that money or work can make."""
    camera, plate, pattern = given.camera, given.plate, given.pattern

    def row(what: str, unit: str, before: float, after: float, **update: Any) -> Row:
        old, new = (f"{value:.4g} {unit}".rstrip() for value in (before, after))
        return what, old, new, replace(given, **update)

    width, height = camera.pixels
    wide, high = round(width * STEP), round(height * STEP)
    finer = replace(given, camera=changed(camera, pixels=(wide, high)))
    yield "camera pixels", f"{width} × {height}", f"{wide} × {high}", finer
    near = camera.stand_off / STEP
    yield row("stand-off", "mm", camera.stand_off, near, camera=changed(camera, stand_off=near))
    thin = plate.thickness / STEP
    yield row("thickness", "mm", plate.thickness, thin, plate=as_thick(plate, thin))
    for diameter in (pattern.diameter / STEP, pattern.diameter * STEP):
        other = changed(pattern, diameter=diameter)
        yield row("speckle diameter", "mm", pattern.diameter, diameter, pattern=other)
    contrast = min(1.0, pattern.contrast * STEP)
    if contrast > pattern.contrast:
        strong = changed(pattern, contrast=contrast)
        yield row("speckle contrast", "", pattern.contrast, contrast, pattern=strong)
    if given.sensor.noise:
        low = given.sensor.noise / STEP
        quiet = changed(given.sensor, noise=low)
        yield row("sensor noise", "grey levels", given.sensor.noise, low, sensor=quiet)
    yield row("mean of frames", "", given.frames, AVERAGED, frames=AVERAGED)
    count = given.dic.reference_frames
    more = changed(given.dic, reference_frames=AVERAGED * count)
    yield row("reference frames", "", count, AVERAGED * count, dic=more)


def changed(section: Any, **update: object) -> Any:
    """Copy a section with other values."""
    return section.model_copy(update=update)


def as_thick(plate: PlateSection, thickness: float) -> PlateSection:
    """Copy a plate with another thickness, mm, and its patches in proportion."""
    part = thickness / plate.thickness
    patches = tuple(
        changed(patch, thickness=part * (patch.thickness or plate.thickness))
        for patch in plate.patches
    )
    return changed(plate, thickness=thickness, patches=patches)

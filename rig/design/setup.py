"""What a design is made from: the sections of a scene, and copies of them with other values."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rig.scene import Scene
from rig.scene.bench import CameraSection, PatternSection, SensorSection
from rig.scene.plate import PlateSection
from rig.scene.sensing import DicSection

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
        """What decides how touches are seen, whatever the pattern, the noise and the focus."""
        return self.plate, changed(self.camera, lens=None), self.tile

    @property
    def tile(self) -> int:
        """Side of a tile, px; of large images no more than 64 tiles a side are needed."""
        return max(self.dic.tile, max(self.camera.pixels) // 64)


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


def at_distance(camera: CameraSection, stand_off: float) -> CameraSection:
    """Copy a camera at another distance, mm, with a lens that sees as much and is focused alike."""
    part, lens = stand_off / camera.stand_off, camera.lens
    if lens is not None:
        lens = changed(lens, focal=part * lens.focal, focus=part * lens.focus)
    return changed(camera, stand_off=stand_off, lens=lens)


def focused(given: Setup, distance: float) -> Setup:
    """Copy a setup with its lens, where the scene names one, focused at a distance, mm."""
    camera = given.camera
    lens = None if camera.lens is None else changed(camera.lens, focus=distance)
    return replace(given, camera=changed(camera, lens=lens))

"""The digital twin: frames of a plate that a script touches, with the truth beside them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import fe
import rig.script
import synthetic
from rig import cache
from rig.scene import Scene
from rig.scene.bench import Pattern, Pinhole, Plate, Sensor
from rig.scene.loop import Twin as TwinSection
from rig.script import Script

FINENESS = 0.64  # elements along a side, as a share of the default mesh
INSET = 25.0  # mm from an edge within which random touches stay


@dataclass(frozen=True, eq=False)
class Twin:
    """Everything that makes a frame from its number.

    Attributes
    ----------
    solver : fe.Linear
        The plate, its stiffness factored.
    warper : synthetic.Warper
        The speckle pattern as the camera sees it, ready to be warped.
    sensor : synthetic.Sensor
    script : Script
    rate : float, frames a second
    seed : int
        Seed of the sensor's noise; every frame draws from (seed, sequence).
    shift : (float, float), px
        Motion of the camera after the reference was taken.
    """

    solver: fe.Linear
    warper: synthetic.Warper
    sensor: synthetic.Sensor
    script: Script
    rate: float
    seed: int
    shift: tuple[float, float]

    def touches(self, sequence: int) -> tuple[fe.Touch, ...]:
        """Touches on the plate while frame `sequence` is taken."""
        return self.script(sequence / self.rate)

    def frame(
        self, sequence: int, touches: tuple[fe.Touch, ...], out: NDArray[np.uint8] | None = None
    ) -> NDArray[np.uint8]:
        """Picture of the touched plate, (H, W), the same for the same arguments."""
        displacement = np.zeros((len(self.warper.points), 3))
        if touches:
            displacement = self.solver.deflect(touches).displacement(self.warper.points, "top")
        moved = sequence / self.rate > rig.script.STILL
        return self.warper.render(
            displacement,
            self.sensor,
            np.random.default_rng((self.seed, sequence)),
            shift=self.shift if moved else (0.0, 0.0),
            out=out,
        )


def build_twin(scene: Scene, progress: Callable[[int, int], None] | None = None) -> Twin:
    """Build the twin of a scene; the sharp pattern is kept in the cache.

    Raises
    ------
    ValueError
        If the scene has no twin as its source.
    """
    match scene:
        case Scene(
            plate=Plate() as plate,
            camera=Pinhole() as camera,
            pattern=Pattern() as pattern,
            sensor=Sensor() as sensor,
            source=TwinSection() as source,
        ):
            pass
        case _:
            raise ValueError("scene has no [source] of kind 'twin'; add it to render frames")
    view = camera.build(plate)
    flat = plate.build()
    arrays = cache.fetch(
        "sharp-pattern",
        (synthetic, pattern.model_dump(), view, plate.thickness),
        lambda: synthetic.prepare_warp(pattern.build(plate), view, plate.thickness / 2).arrays(),
    )
    return Twin(
        solver=fe.Linear(flat, _mesh(flat)),
        warper=synthetic.Warper.from_arrays(view, plate.thickness / 2, arrays),
        sensor=sensor.build(),
        script=_script(scene, source),
        rate=camera.rate,
        seed=source.seed,
        shift=source.shift,
    )


def _mesh(plate: fe.Plate) -> fe.Mesh:
    """Mesh that is solved anew each frame: right to 1e-4 at a third of the usual cost."""
    usual = fe.default_mesh(plate)
    nx, ny = usual.counts
    return fe.Mesh(plate.size, (max(6, round(FINENESS * nx)), max(6, round(FINENESS * ny))))


def _script(scene: Scene, source: TwinSection) -> Script:
    if scene.plate is None or scene.camera is None:
        raise ValueError("a twin needs [plate] and [camera]; add them to the scene")
    match source.script:
        case "tour":
            return rig.script.tour(scene.plate.size)
        case "random":
            force = scene.touches.force if scene.touches else (1.0, 1.0)
            return rig.script.random_touches(
                scene.plate.size, force, INSET, source.seed, scene.camera.rate
            )
        case "empty":
            return rig.script.empty

"""The digital twin: frames of a plate that a script touches, with the truth beside them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import fe
import synthetic
from rig.plates.plate_solver import Solver, plate_solver, solve_plate
from rig.scene import Scene
from rig.scene.bench import CameraSection, PatternSection, SensorSection
from rig.scene.plate import PlateSection, TouchesSection
from rig.scene.source import TwinSection
from rig.sources import script
from rig.sources.held_board import HeldBoard, held_before, lying_on
from rig.sources.letters import letters
from rig.sources.script import Script
from rig.system import cache

WRITES = 1.5  # s after which the finger of the script 'letters' lands
ELEMENTS = 64  # along the longer side: deflections within 3e-4 at a third of the usual cost


@dataclass(frozen=True, eq=False)
class Twin:
    """Everything that makes a frame from its number.

    Attributes
    ----------
    solver : fe.Linear or fe.Reduced
        The plate under small touches, its stiffness factored, or under large ones.
    warper : synthetic.Warper
        The speckle pattern as the camera sees it, ready to be warped.
    sensor : synthetic.SensorSection
    script : Script
    rate : float, frames a second
    seed : int
        Seed of the sensor's noise; every frame draws from (seed, sequence).
    shift : (float, float), px
        Motion of the camera after the reference was taken.
    radius : float, mm
        Of the disc that a touch presses.
    rest : int
        Frames in which the plate stands still before its script begins.
    board : HeldBoard or None
        What is held before the camera in the place of the plate.
    """

    solver: Solver
    warper: synthetic.Warper
    sensor: synthetic.Sensor
    script: Script
    rate: float
    seed: int
    shift: tuple[float, float]
    radius: float
    rest: int = 0
    board: HeldBoard | None = None

    def time(self, sequence: int) -> float:
        """Time of the script at frame `sequence`, s."""
        return max(0, sequence - self.rest) / self.rate

    def touches(self, sequence: int) -> tuple[fe.Touch, ...]:
        """Touches on the plate while frame `sequence` is taken."""
        return tuple(
            replace(touch, radius=self.radius) for touch in self.script(self.time(sequence))
        )

    def frame(
        self, sequence: int, touches: tuple[fe.Touch, ...], out: NDArray[np.uint8] | None = None
    ) -> NDArray[np.uint8]:
        """Image of the touched plate, (H, W), the same for the same arguments."""
        rng = np.random.default_rng((self.seed, sequence))
        if self.board:
            return self.sensor.capture(self.board.light(sequence / self.rate), rng, out)
        displacement = np.zeros((len(self.warper.points), 3))
        if touches:
            state, face = solve_plate(self.solver, touches), self.warper.camera.face
            displacement = state.displacement(self.warper.points, face)
        return self.warper.render(
            displacement,
            self.sensor,
            rng,
            shift=(0.0, 0.0) if script.at_rest(self.time(sequence)) else self.shift,
            out=out,
        )


def build_twin(scene: Scene, progress: Callable[[int, int], None] | None = None) -> Twin:
    """Build the twin of a scene; the sharp pattern is kept in the cache.

    Under large touches the plate is the reduced one: a shell takes seconds a frame.

    Raises
    ------
    ValueError
        If the scene has no twin as its source, or its script needs a section that is not there.
    """
    match scene:
        case Scene(
            plate=PlateSection() as plate,
            camera=CameraSection() as camera,
            pattern=PatternSection() as pattern,
            sensor=SensorSection() as sensor,
            source=TwinSection() as source,
        ):
            pass
        case _:
            raise ValueError(
                f"scene '{scene.title}' has no twin; add [source] with kind = \"twin\""
            )
    play = _script(source, plate, scene.touches, camera.rate)
    view = camera.build(plate)
    height = view.face_height(plate.thickness)
    arrays = cache.fetch(
        "sharp-pattern",
        (synthetic, pattern.model_dump(), view, plate.thickness),
        lambda: synthetic.prepare_warp(pattern.build(plate), view, height).arrays(),
    )
    return Twin(
        solver=plate_solver(scene, plate, ELEMENTS, progress or (lambda done, total: None)),
        warper=synthetic.Warper.from_arrays(view, height, arrays),
        sensor=sensor.build(),
        script=play,
        rate=camera.rate,
        seed=source.seed,
        shift=source.shift,
        radius=scene.touches.radius if scene.touches else 0.0,
        board=_board(source, plate, view),
    )


def _board(source: TwinSection, plate: PlateSection, view: synthetic.AnyCamera) -> HeldBoard | None:
    match source.script:
        case "board":
            return held_before(view, plate.size)
        case "board-on-plate":
            return lying_on(view, plate.size, view.face_height(plate.thickness))
        case _:
            return None


def _script(
    source: TwinSection, plate: PlateSection, touches: TouchesSection | None, rate: float
) -> Script:
    match source.script, touches:
        case "tour", _:
            return script.tour(plate.size)
        case "empty" | "board" | "board-on-plate", _:
            return script.empty
        case "letters", TouchesSection(force=force):
            return letters(plate.size, source.text, force[1], WRITES, source.pace)
        case "collect", TouchesSection(force=force):
            return script.collect(plate.size, force, source.seed)
        case _, TouchesSection(force=force):
            return script.random_touches(plate.size, force, source.seed, rate)
        case name, None:
            raise ValueError(
                f"script '{name}' draws its forces from [touches]; add [touches] to the scene"
            )

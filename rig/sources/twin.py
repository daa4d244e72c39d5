"""The digital twin: frames of a plate that a script touches, with the truth beside them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import fe
import synthetic
from rig.plates.plate_solver import Solver, plate_solver, solve_plate
from rig.scene import Scene
from rig.scene.bench import CameraSection, PatternSection, SensorSection
from rig.scene.departure import DepartureSection
from rig.scene.plate import BaseSection, PlateSection, TouchesSection
from rig.scene.source import TwinSection
from rig.scene.theory import choose, largest_force
from rig.sources import script
from rig.sources.held_board import HeldBoard, held_before, lying_on
from rig.sources.letters import letters
from rig.sources.performed import melody, weights
from rig.sources.real_twin import RealTwin, build_real_twin
from rig.sources.ringing import RingingFace, require_plain, ringing_face
from rig.sources.script import Script
from rig.system import cache
from rig.system.arrays import F64

if TYPE_CHECKING:
    from rig.sources.bent_twin import BentTwin

WRITES = 1.5  # s after which the finger of the script 'letters' lands
INSTANTS = 5  # of a readout in which the plate is solved: touches go straight in between
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
    readout : float, s
        From the reading of the first row to that of the last; 0 for a global shutter.
    board : HeldBoard or None
        What is held before the camera in the place of the plate.
    ringing : RingingFace or None
        None where the plate is at equilibrium in every frame.
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
    readout: float = 0.0
    board: HeldBoard | None = None
    ringing: RingingFace | None = None

    def time(self, sequence: int) -> float:
        """Time of the script at frame `sequence`, s."""
        return max(0, sequence - self.rest) / self.rate

    def touches(self, sequence: int) -> tuple[fe.Touch, ...]:
        """Touches on the plate in the middle of the readout, or exposure, of frame `sequence`."""
        before = self.ringing.exposure / 2 if self.ringing else 0.0
        return self._touches(max(self.time(sequence) - before, 0.0))

    def _touches(self, time: float) -> tuple[fe.Touch, ...]:
        return tuple(replace(touch, radius=self.radius) for touch in self.script(time))

    def frame(
        self, sequence: int, touches: tuple[fe.Touch, ...], out: NDArray[np.uint8] | None = None
    ) -> NDArray[np.uint8]:
        """Image of the touched plate, (H, W), the same for the same arguments."""
        rng = np.random.default_rng((self.seed, sequence))
        if self.board:
            return self.sensor.capture(self.board.light(sequence / self.rate), rng, out)
        return self.warper.render(
            self._displacement(sequence, touches),
            self.sensor,
            rng,
            shift=(0.0, 0.0) if script.at_rest(self.time(sequence)) else self.shift,
            out=out,
        )

    def _displacement(self, sequence: int, touches: tuple[fe.Touch, ...]) -> F64:
        """Displacement of the seen face, each point when its row is read, (G, 3) mm.

        Touches that are not those of the script stay as they are while all rows are read.
        """
        if self.ringing and touches == self.touches(sequence):
            return self.ringing.displacement(self.time(sequence), self._touches, self._moved)
        if not self.readout or touches != self.touches(sequence):
            return self._moved(touches)
        middle, before = self.time(sequence), self.readout / 2
        instants = np.linspace(middle - before, middle + before, INSTANTS)
        moved = [self._moved(self._touches(max(float(time), 0.0))) for time in instants]
        return synthetic.while_read(moved, self.warper.read_at)

    def _moved(self, touches: tuple[fe.Touch, ...]) -> F64:
        """Displacement of the seen face under touches, (G, 3) mm."""
        if not touches:
            return np.zeros((len(self.warper.points), 3))
        state, face = solve_plate(self.solver, touches), self.warper.camera.face
        return np.asarray(state.displacement(self.warper.points, face), dtype=np.float64)


def _quiet(done: int, total: int) -> None:
    """Say nothing of progress."""


def open_play(
    scene: Scene, report: Callable[[int, int], None] = _quiet
) -> Twin | RealTwin | BentTwin:
    """Build the twin of a scene, on its bench as it is described or as it really is, or bent.

    Parameters
    ----------
    scene : Scene
    report : callable
        Called with how many of how many steps are done.

    Raises
    ------
    ValueError
        See `build_twin`, `build_real_twin` and `build_bent_twin`.
    """
    match scene:
        case Scene(source=TwinSection(rings=True)):
            return build_twin(scene, report)
        case Scene(
            plate=PlateSection() as plate,
            base=BaseSection() as base,
            camera=CameraSection() as camera,
            pattern=PatternSection() as pattern,
            sensor=SensorSection() as sensor,
            source=TwinSection() as source,
        ):
            from rig.sources.bent_twin import build_bent_twin

            sections = plate, camera, pattern, sensor
            return build_bent_twin(sections, base, source, scene.touches, report)
        case Scene(
            plate=PlateSection() as plate,
            camera=CameraSection() as camera,
            pattern=PatternSection() as pattern,
            sensor=SensorSection() as sensor,
            source=TwinSection(departure=DepartureSection() as departure) as source,
        ):
            play = _script(source, plate, scene.touches, camera.rate)
            radius = scene.touches.radius if scene.touches else 0.0
            sections = plate, camera, pattern, sensor
            return build_real_twin(sections, source, departure, play, radius, report)
        case _:
            return build_twin(scene, report)


def build_twin(scene: Scene, report: Callable[[int, int], None] = _quiet) -> Twin:
    """Build the twin of a scene on the bench described; the sharp pattern is kept in the cache.

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
    if source.rings:
        require_plain(scene, choose(scene, plate, largest_force(scene)).name)
    solver = plate_solver(scene, plate, ELEMENTS, report)
    warper = synthetic.Warper.from_arrays(view, height, arrays)
    ringing = None
    if source.rings:
        ringing = ringing_face(scene, plate.build(), warper.points, view.face, report)
    return Twin(
        solver=solver,
        warper=warper,
        sensor=sensor.build(),
        script=play,
        rate=camera.rate,
        seed=source.seed,
        shift=source.shift,
        radius=scene.touches.radius if scene.touches else 0.0,
        readout=camera.readout,
        board=_board(source, plate, view),
        ringing=ringing,
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
    match source.script:
        case "tour":
            return script.tour(plate.size)
        case "empty" | "board" | "board-on-plate":
            return script.empty
        case _:
            return _forceful(source, plate, touches, rate)


def _forceful(
    source: TwinSection, plate: PlateSection, touches: TouchesSection | None, rate: float
) -> Script:
    """Return a script that draws its forces from the touches that are expected."""
    match source.script, touches:
        case "letters", TouchesSection(force=force):
            return letters(plate.size, source.text, force[1], WRITES, source.pace)
        case "weights", TouchesSection(force=force):
            return weights(plate.size, force)
        case "melody", TouchesSection(force=force):
            return melody(plate.size, force)
        case "presses", TouchesSection(force=force):
            return script.pressing(plate.size, script.presses(plate.size, force, source.seed))
        case "taps", TouchesSection(force=force):
            return script.taps(plate.size, force, source.seed)
        case "collect", TouchesSection(force=force):
            return script.collect(plate.size, force, source.seed)
        case _, TouchesSection(force=force):
            return script.random_touches(plate.size, force, source.seed, rate)
        case name, None:
            raise ValueError(
                f"script '{name}' draws its forces from [touches]; add [touches] to the scene"
            )

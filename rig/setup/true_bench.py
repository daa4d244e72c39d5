"""What the bench of a rehearsal really is, and what makes its images."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

import fe
import synthetic
from rig.plates.plate_solver import Solver, plate_solver, solve_plate
from rig.projector.content import Content, draw
from rig.projector.markers import Screen, fit_plate, project
from rig.projector.outputs import Output
from rig.scene.load import with_overrides
from rig.setup.answers import Answers
from rig.setup.scene_file import board_for, corner_of_board, scene_of
from rig.sources.held_board import TILTS, HeldBoard
from rig.sources.twin import ELEMENTS
from rig.system import cache
from rig.system.arrays import F32, F64

NOISE, FULL_WELL = 0.8, 12_000.0  # grey levels; electrons
FINE = 2  # parts of a pixel along each side, on which light is looked up
LAPTOP = Output(0, "eDP-1", (1366, 768), (0, 0))
PROJECTOR = Output(1, "HDMI-1", (1280, 800), (1366, 0))


@dataclass(frozen=True, eq=False)
class TrueBench:
    """What the bench of a rehearsal really is.

    Attributes
    ----------
    camera : synthetic.Camera
    stiffness : float
        Young's modulus over that of the scene.
    screen : Screen
        Where the projector shows the plate.
    """

    camera: synthetic.Camera
    stiffness: float
    screen: Screen


def draw_truth(answers: Answers, seed: int) -> TrueBench:
    """Draw a bench that is as its owner describes it, as far as he can know."""
    scene, rng = scene_of(answers, rehearsal=True), np.random.default_rng(seed)
    plate, section = scene.plate, scene.camera
    if plate is None or section is None:
        raise ValueError("a rehearsal needs plate and camera; answer the questions about them")
    nominal = section.build(plate)
    if not isinstance(nominal, synthetic.Camera):
        raise ValueError('camera has no lens to be calibrated; set camera.kind to "pinhole"')
    a, b = plate.size
    away = np.sign(nominal.position[2]) * answers.stand_off
    stand = np.array([a / 2, b / 2, 1.012 * away])
    stand[:2] += rng.normal(0.0, 0.012 * answers.stand_off, 2)
    target = np.array([*(np.array([a, b]) / 2 + rng.normal(0.0, 1.0, 2)), 0.0])
    bent = synthetic.Distortion(*rng.normal((-0.06, 0.02, 0.0, 0.0), (0.01, 0.005, 2e-4, 2e-4)))
    camera = synthetic.Camera(
        nominal.size,
        nominal.focal * (1 + rng.uniform(-0.008, 0.0)),
        tuple((np.array(nominal.centre) + rng.normal(0.0, 3.0, 2)).tolist()),
        synthetic.look_at(stand, target, (0.0, 1.0, 0.0)),
        bent,
    )
    straight = fit_plate(PROJECTOR.size, plate.size).T_px_plate
    turned, moved = rng.normal(0.0, 0.015, (2, 2)), np.array([[8.0], [-6.0]])
    askew = np.block(
        [[np.eye(2) + turned, moved], [rng.normal(0.0, 1e-5, (1, 2)), np.ones((1, 1))]]
    )
    return TrueBench(camera, float(rng.uniform(0.9, 1.1)), Screen(PROJECTOR.size, askew @ straight))


@dataclass(frozen=True, eq=False)
class Scenery:
    """All that makes an image: the plate, the board in the hand and on the plate, the light."""

    answers: Answers
    truth: TrueBench
    solver: Solver
    warper: synthetic.Warper
    held: HeldBoard
    lying: HeldBoard
    sensor: synthetic.Sensor
    places: F32  # px of the projector that the parts of each pixel see, (FINE H, FINE W, 2)

    def plate(self, touches: tuple[fe.Touch, ...]) -> F32:
        """Return what the plate reflects, (H, W) from 0 to 1."""
        moved = np.zeros((len(self.warper.points), 3))
        if touches:
            state, face = solve_plate(self.solver, touches), self.truth.camera.face
            moved = state.displacement(self.warper.points, face)
        return np.asarray(self.warper.render(moved, None, None) / 255.0, dtype=np.float32)

    def falls(self, content: Content, screen: Screen) -> F32:
        """See `RehearsedBench`."""
        width, height = self.truth.camera.size
        if not content:
            return np.zeros((height, width), np.float32)
        shown = draw(content, screen).mean(axis=2, dtype=np.float32) / 255.0
        seen = cv2.remap(shown, self.places[..., 0], self.places[..., 1], cv2.INTER_LINEAR)
        return np.asarray(
            cv2.resize(seen, (width, height), interpolation=cv2.INTER_AREA), np.float32
        )


def build_scenery(answers: Answers, truth: TrueBench) -> Scenery:
    """Build what makes the images of a true bench; the sharp pattern is kept in the cache."""
    scene = scene_of(answers, rehearsal=True)
    true = with_overrides(
        scene,
        {
            "plate.young": truth.stiffness * (scene.plate.young if scene.plate else 1.0),
            "touches.force": (0.1 * answers.weight, answers.weight),
        },
    )
    plate, pattern = true.plate, true.pattern
    if plate is None or pattern is None:
        raise ValueError("a rehearsal needs plate and pattern; answer the questions about them")
    height = truth.camera.face_height(plate.thickness)
    arrays = cache.fetch(
        "sharp-pattern",
        (synthetic, pattern.model_dump(), truth.camera, plate.thickness, plate.size),
        lambda: synthetic.prepare_warp(pattern.build(plate), truth.camera, height).arrays(),
    )
    board, corner = board_for(answers), np.array(corner_of_board(answers))
    middle = np.array([*(corner + np.array(board.size) / 2), height])
    over = np.array([*(np.array(plate.size) / 2), 0.0])
    return Scenery(
        answers=answers,
        truth=truth,
        solver=plate_solver(true, plate, ELEMENTS, lambda done, total: None),
        warper=synthetic.Warper.from_arrays(truth.camera, height, arrays),
        held=HeldBoard(board, truth.camera, over, TILTS),
        lying=HeldBoard(board, truth.camera, middle, ((0.0, 0.0),)),
        sensor=synthetic.Sensor(noise=NOISE, full_well=FULL_WELL),
        places=_places(truth, height),
    )


def _places(truth: TrueBench, height: float) -> F32:
    """Px of the projector that the parts of each pixel of the camera see."""
    wide, high = (FINE * side for side in truth.camera.size)
    x, y = np.meshgrid(np.arange(wide), np.arange(high))
    px = (np.stack([x, y], axis=-1).reshape(-1, 2) + 0.5) / FINE - 0.5
    on_plate: F64 = truth.camera.on_plate(px, height)
    return project(truth.screen.T_px_plate, on_plate).reshape(high, wide, 2).astype(np.float32)

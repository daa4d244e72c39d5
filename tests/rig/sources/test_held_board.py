"""The guided calibration of lens and plate rehearsed in the twin: what is found is what was set."""

import numpy as np
import pytest

import rig
import synthetic
from rig.calibration.board import CharucoBoard
from rig.calibration.board_guides import LensGuide, PoseGuide
from rig.sources.held_board import HOLD, held_before, lying_on
from rig.system.frame import Frame

PLATE, PIXELS, RATE = (260.0, 220.0), (800, 640), 30.0
BOARD = CharucoBoard()


@pytest.fixture(scope="module")
def scene():
    changes = {"plate.size": list(PLATE), "camera.pixels": list(PIXELS), "source.script": "board"}
    return rig.load("twin", changes)


@pytest.fixture(scope="module")
def camera(scene):
    return scene.camera.build(scene.plate)


def frames(board, scene, count, step):
    sensor, rng = scene.sensor.build(), np.random.default_rng(3)
    for number in range(count):
        time = number * step
        yield Frame(number, time, sensor.capture(board.light(time), rng))


@pytest.fixture(scope="module")
def lens(scene, camera):
    guide = LensGuide(BOARD)
    for frame in frames(held_before(camera, PLATE), scene, 40, HOLD / 2):
        guide.add_frame(frame)
        if guide.result():
            break
    return guide.result()


def test_the_board_is_held_until_the_lens_is_known(lens, camera):
    assert lens.focal == pytest.approx(camera.focal, rel=0.003)
    assert np.abs(np.subtract(lens.centre, camera.centre)).max() < 3.0  # px
    assert lens.error < 0.1  # mm, as it states itself


@pytest.mark.parametrize(("stand", "side"), [("pinhole_above", 1.0), ("pinhole_below", -1.0)])
def test_the_board_on_the_plate_gives_the_pose_to_0_15_mm(lens, scene, stand, side):
    camera = getattr(synthetic, stand)(PLATE, 500.0, PIXELS)
    height = side * scene.plate.thickness / 2
    # Its left edge in the image is that of smaller x above, and of larger x below.
    corner = (PLATE[0] - side * BOARD.size[0]) / 2, (PLATE[1] + BOARD.size[1]) / 2
    guide = PoseGuide(lens, BOARD, corner, height, wanted=4)
    for frame in frames(lying_on(camera, PLATE, height), scene, 5, 1 / RATE):
        guide.add_frame(frame)
    found = guide.result().camera
    grid = np.stack(np.meshgrid([10.0, 130.0, 250.0], [10.0, 110.0, 210.0]), -1).reshape(-1, 2)
    px = camera.project(np.column_stack([grid, np.full(len(grid), height)]))
    away = np.linalg.norm(found.on_plate(px, height) - grid, axis=1)
    assert away.max() < 0.15  # mm


def test_a_board_before_a_camera_below_is_seen_by_its_print():
    held = held_before(synthetic.pinhole_below(PLATE, 500.0, PIXELS), PLATE)
    for turn in (0, 5):
        image = (255 * held.light(turn * HOLD)).astype(np.uint8)
        assert BOARD.find(image) is not None
        assert not BOARD.is_mirrored(image)


def test_a_board_that_does_not_fit_is_refused(camera):
    with pytest.raises(ValueError, match=r"220 × 160 mm does not fit on the plate of 200 × 150 mm"):
        held_before(camera, (200.0, 150.0))


def test_a_telecentric_camera_has_no_lens_to_find(scene):
    other = rig.load("twin", {"camera.kind": "telecentric"})
    with pytest.raises(ValueError, match=r'set camera.kind to "pinhole"'):
        held_before(other.camera.build(other.plate), PLATE)

"""Lens and pose from rendered boards whose place is known."""

import numpy as np
import pytest

import synthetic
from rig.calibration.board import BoardView, CharucoBoard, on_plate
from rig.calibration.lens import Lens, calibrate_lens
from rig.calibration.pose import find_pose

BOARD = CharucoBoard(squares=(11, 9), square=20.0, marker=15.0)
SCALE = 6.0  # px of the drawn board per mm
STANDS = [
    (127, 100, 430), (330, 100, 380), (-90, 120, 370), (127, 320, 360), (130, -130, 380),
    (300, 290, 340), (-60, -70, 400), (200, 60, 300),
]  # fmt: skip


def render_board(room, camera, rng, board=BOARD, T=((1.0, 0, 10.0), (0, -1.0, 190.0)), height=0.0):
    """Image of a board that lies on a plane, its mm taken to the plane's by T."""
    T = np.asarray(T)
    places = room.places_seen(camera, height)
    mm = (places - T[:, 2]) @ np.linalg.inv(T[:, :2]).T
    drawn = 40 + board.draw(SCALE) * (170 / 255)
    return room.photograph(room.look_up(drawn, mm * SCALE - 0.5).mean(axis=2), rng)


def take(room, stands=STANDS):
    rng = np.random.default_rng(5)
    found = []
    for stand in stands:
        view = BOARD.find(render_board(room, room.camera_at(stand), rng))
        assert view is not None
        found.append(view)
    return found


@pytest.fixture(scope="module")
def views(room):
    return take(room)


@pytest.fixture(scope="module")
def lens(room, views):
    return calibrate_lens(views, room.size)


def test_the_lens_is_found_and_its_uncertainty_is_honest(room, lens):
    assert lens.residual < 0.15  # px
    assert lens.error < 0.1  # mm
    assert abs(lens.focal - room.focal) < max(4 * lens.sigma_focal, 1.0)
    # Wherever the board may lie, a ray goes where it should.
    true = room.camera_at((127, 100, 430))
    near = lens.camera(true.T_cam_plate)
    grid = np.stack(np.meshgrid(np.linspace(0, 254, 9), np.linspace(0, 200, 7)), -1).reshape(-1, 2)
    points = np.column_stack([grid, np.zeros(len(grid))])
    offset = near.project(points) - true.project(points)
    assert np.abs(offset - offset.mean(0)).max() < 0.4  # px; a shift is the pose's


def test_a_bad_view_is_left_out_and_named(room, views, rng):
    views = list(views)
    worse = views[3].px + rng.normal(0, 3.0, views[3].px.shape)
    views[3] = BoardView(views[3].mm, worse)
    lens = calibrate_lens(views, room.size)
    assert 3 in lens.left_out
    assert lens.focal == pytest.approx(room.focal, rel=0.01)
    chosen = calibrate_lens(views, room.size, left_out=(3, 5))
    assert {3, 5} <= set(chosen.left_out)


def test_too_few_views_are_refused(room, views):
    with pytest.raises(ValueError, match="needs 4 good views of the board or more, got 2"):
        calibrate_lens(views[:2], room.size)


def test_the_plate_is_found_to_0_15_mm_from_patches_and_says_so(room, lens, rng):
    """Two small boards on the plate, its face 1 mm over the middle plane."""
    camera = room.camera_at((150.0, 60.0, 470.0))
    true = synthetic.Camera(room.size, room.focal, room.centre, camera.T_cam_plate, room.lens)
    T = np.array([[1.0, 0, 5.0], [0, -1.0, 185.0]])
    view = BOARD.find(render_board(room, true, rng, T=T, height=1.0))
    pose = find_pose(lens, on_plate([(view, T)], height=1.0))
    grid = np.stack(np.meshgrid([10, 127, 240], [10, 100, 190]), -1).reshape(-1, 2)
    px = true.project(np.column_stack([grid, np.ones(len(grid))]))
    away = np.linalg.norm(pose.camera.on_plate(px, 1.0) - grid, axis=1)
    assert away.max() < 0.15  # mm
    assert pose.residual < 0.2
    assert pose.error < 0.15


@pytest.mark.slow
def test_the_stated_error_of_a_pose_is_that_of_many_poses(room, rng):
    """Corners marked by hand, 0.5 px: scatter of a place against what each pose says of it."""
    lens = Lens(room.size, room.focal, room.centre, room.lens, 0.0, 0.0, 0.0, ())
    camera = room.camera_at((140.0, 80.0, 470.0))
    corners = np.array([(0, 0, 1), (254, 0, 1), (254, 203, 1), (0, 203, 1)], dtype=float)
    px = camera.project(corners)
    middle = np.array([[60.0, 50.0, 1.0]])
    seen = camera.project(middle)
    places, stated, at_corners = [], [], []
    for _ in range(300):
        pose = find_pose(lens, BoardView(corners, px + rng.normal(0, 0.5, px.shape)), sigma=0.5)
        places.append(pose.camera.on_plate(seen, 1.0)[0])
        at_corners.append(pose.camera.on_plate(px, 1.0) - corners[:, :2])
        stated.append(pose.error)
    rms = np.sqrt(np.mean(np.square(at_corners).sum(axis=-1)))
    assert np.mean(stated) == pytest.approx(rms, rel=0.1)
    assert np.abs(np.mean(places, axis=0) - (60.0, 50.0)).max() < 0.05


def test_the_corners_give_the_pose_of_a_camera_below_and_no_other(room):
    lens = Lens(room.size, room.focal, room.centre, room.lens, 0.0, 0.0, 0.0, ())
    camera = room.camera_at((110.0, 120.0, -470.0))
    corners = np.array([(0, 0, -1), (254, 0, -1), (254, 203, -1), (0, 203, -1)], dtype=float)
    px = camera.project(corners)
    pose = find_pose(lens, BoardView(corners, px), sigma=0.1)
    np.testing.assert_allclose(pose.camera.T_cam_plate, camera.T_cam_plate, atol=1e-4)
    for height, there in ((1.0, "above"), (-1.0, "below")):
        here = "below" if there == "above" else "above"
        on_face = corners * (1, 1, 0) + (0, 0, height)
        wrong = px if there == "above" else px[[1, 0, 3, 2]]
        with pytest.raises(ValueError, match=f"seen from {here}, and the scene .* camera {there}"):
            find_pose(lens, BoardView(on_face, wrong), sigma=0.1)


def test_what_shows_no_board_is_none(rng):
    assert BOARD.find(rng.integers(0, 255, (300, 400), dtype=np.uint8)) is None


def test_a_board_that_cannot_be_is_refused():
    with pytest.raises(ValueError, match="markers smaller than a square, got 11 × 8 squares of 20"):
        CharucoBoard(marker=25.0)

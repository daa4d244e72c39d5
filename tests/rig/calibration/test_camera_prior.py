"""What boards leave open of a camera: drawn boards against what is stated of it."""

from datetime import UTC, datetime

import numpy as np
import pytest

import fe
import models
import synthetic
from rig.calibration import camera_prior
from rig.calibration.board import BoardView
from rig.calibration.camera_prior import LENS, camera_covariance
from rig.calibration.lens import Lens, calibrate_lens
from rig.calibration.pose import Pose, find_pose
from rig.calibration.results import entry_of
from rig.calibration.store import Calibration

SIZE, MIDDLE = (254.0, 203.0), (127.0, 101.5, 0.0)
PLATE = fe.Plate(SIZE, 1.0, 3000.0, 0.38)
NUMBERS = [name for name, _ in models.CAMERA]
POSE = slice(0, 6)
CORNERS = np.stack(np.meshgrid(30 + 20 * np.arange(10), 30 + 20 * np.arange(8)), -1).reshape(-1, 2)
STANDS = [
    (127, 100, 430), (330, 100, 380), (-90, 120, 370), (127, 320, 360), (130, -130, 380),
    (300, 290, 340), (-60, -70, 400), (200, 60, 300),
]  # fmt: skip
ON_FACE = np.column_stack([CORNERS, np.full(len(CORNERS), 0.5)])
IN_DEPTH = np.stack(np.meshgrid(*(np.linspace(0, n, 8) for n in SIZE), (-24.0, 1.0, 25.0)), -1)
IN_DEPTH = IN_DEPTH.reshape(-1, 3)


@pytest.fixture
def corners_alone(monkeypatch):
    """Leave out what no corner shows."""
    for name in ("_LAID", "_BULGE", "_THICK", "_FOCAL"):
        monkeypatch.setattr(camera_prior, name, 0.0)


def numbers_of(true, found):
    """Find the numbers by which a camera is other than one that was found."""
    numbers, steps = np.zeros(9), np.array([1e-4] * 3 + [0.02] * 3 + [1e-4, 3e-4, 3e-4])
    for _ in range(6):
        ends = [
            [
                models.varied(found, MIDDLE, numbers + sign * step).project(IN_DEPTH).ravel()
                for sign in (1, -1)
            ]
            for step in np.diag(steps)
        ]
        slopes = np.column_stack(
            [(a - b) / (2 * step) for (a, b), step in zip(ends, steps, strict=True)]
        )
        off = true.project(IN_DEPTH) - models.varied(found, MIDDLE, numbers).project(IN_DEPTH)
        numbers = numbers + np.linalg.lstsq(slopes, off.ravel(), rcond=None)[0]
    return numbers


def test_errors_of_lens_and_pose_from_drawn_corners_are_as_stated(room, corners_alone):
    rng, true = np.random.default_rng(1), room.camera_at((150.0, 60.0, 470.0))
    whole, of_lens, parts = [], [], []
    for _ in range(12):
        seen = [room.camera_at(stand).project(ON_FACE * (1, 1, 0)) for stand in STANDS]
        seen = [BoardView(CORNERS.copy(), px + rng.normal(0, 0.1, px.shape)) for px in seen]
        lens = calibrate_lens(seen, room.size)
        px = true.project(ON_FACE)
        pose = find_pose(lens, BoardView(ON_FACE, px + rng.normal(0, 0.1, px.shape)))
        given = pose.camera, pose.covariance, lens.covariance, SIZE, 1.0
        stated, off = camera_covariance(*given), numbers_of(true, pose.camera)
        whole.append(off @ np.linalg.solve(stated, off))
        parts.append(off / np.sqrt(np.diag(stated)))
        bent, real = lens.distortion, room.lens
        off = np.array([
            np.log(room.focal / lens.focal), *np.subtract(room.centre, lens.centre),
            real.k1 - bent.k1, real.k2 - bent.k2, real.p1 - bent.p1, real.p2 - bent.p2,
            real.k3 - bent.k3,
        ])  # fmt: skip
        of_lens.append(off @ np.linalg.solve(lens.covariance, off))
        assert lens.sigma_focal > 0.0
    assert 5.0 < np.mean(of_lens) < 12.0  # of 8
    assert 5.0 < np.mean(whole) < 16.0  # of 9
    assert (np.sqrt(np.mean(np.square(parts), axis=0)) < 1.8).all()


def test_a_pose_is_turned_into_the_numbers_of_a_bench(room, corners_alone):
    """Poses drawn as `Pose` has them, about the camera, look as cameras varied by these numbers."""
    rng, camera = np.random.default_rng(2), room.camera_at((90.0, 150.0, 430.0))
    root = rng.normal(size=(6, 6)) * [[2e-3], [2e-3], [2e-3], [0.5], [0.5], [0.5]]
    exact = np.zeros((len(LENS), len(LENS)))
    stated = camera_covariance(camera, root @ root.T, exact, SIZE, 1.0)
    assert not stated[6:].any()
    drawn = []
    for _ in range(200):
        error = root @ rng.normal(size=6)
        pose = camera.T_cam_plate.copy()
        turn = synthetic.rotated(np.eye(4), error[:3], (0.0, 0.0, 0.0))
        pose = turn @ pose
        pose[:3, 3] += error[3:]
        drawn.append(synthetic.Camera(camera.size, camera.focal, camera.centre, pose, room.lens))
    base = camera.project(IN_DEPTH)
    seen = np.array([(one.project(IN_DEPTH) - base).ravel() for one in drawn])
    lower = np.linalg.cholesky(stated[POSE, POSE])
    alike = [np.concatenate([lower @ rng.normal(size=6), np.zeros(3)]) for _ in range(200)]
    alike = np.array(
        [(models.varied(camera, MIDDLE, one).project(IN_DEPTH) - base).ravel() for one in alike]
    )
    spread, wanted = (np.linalg.eigvalsh(each.T @ each / 200)[-6:] for each in (alike, seen))
    np.testing.assert_allclose(spread[-3:], wanted[-3:], rtol=0.35)
    direction = np.linalg.eigh(seen.T @ seen)[1][:, -1]
    assert np.var(alike @ direction) == pytest.approx(np.var(seen @ direction), rel=0.35)


def calibrated(room, lens=None, pose=1e-8):
    """Give a calibration whose pose is known so well, and its lens as given."""
    now, camera = datetime.now(UTC), room.camera_at((150.0, 60.0, 470.0))
    given = room.size, room.focal, room.centre, room.lens, 1e-3 * room.focal, 0.1, 0.01, ()
    of_lens = Lens(*given, covariance=lens)
    found = Pose(camera, pose * np.eye(6), 0.1, 0.03)
    return Calibration(**entry_of(of_lens, now), **entry_of(found, now))


def well_known():
    return np.diag([1e-8, 1e-4, 1e-4, 1e-8, 1e-8, 1e-12, 1e-12, 1e-8])


def test_the_prior_of_a_camera_is_what_boards_leave_and_what_a_ruler_does(room):
    usual = models.bench_before(PLATE)
    known = calibrated(room, well_known()).bench_before(PLATE, room.size)
    better = known.sigma[-9:] / usual.sigma[-9:]
    assert (better < 1.0).all()
    names = dict(zip(NUMBERS, better, strict=True))
    assert max(names[name] for name in ("turn_x", "turn_y", "turn_z", "shift_x", "shift_y")) < 0.31
    assert max(names[name] for name in ("focal", "k1", "k2")) < 0.12
    assert known["shift_x"][1] > 0.25, "a board lies where a ruler has it"
    assert known["shift_z"][1] > 0.8, "how thick a board is was not said"
    assert known.is_prior
    np.testing.assert_array_equal(known.sigma[:-9], usual.sigma[:-9])


@pytest.mark.parametrize("size", [1e-8, 1e-2, 9.0])  # 3 rad is the widest that is read
def test_no_direction_is_less_sure_than_without_boards(room, size):
    known = calibrated(room, size * np.eye(8), size).bench_before(PLATE, room.size)
    usual = models.bench_before(PLATE).prior
    even = known.covariance / np.outer(usual, usual)
    assert np.linalg.eigvalsh(even)[-1] < 1.0 + 1e-9
    assert known.is_sound


def test_of_a_lens_without_sigma_the_prior_stays(room):
    usual, known = models.bench_before(PLATE), calibrated(room).bench_before(PLATE, room.size)
    assert known["k2"][1] == pytest.approx(usual["k2"][1], rel=0.01)
    assert known["k1"][1] == pytest.approx(usual["k1"][1], rel=0.2)
    assert known["focal"][1] < 0.2 * usual["focal"][1]
    alone = calibrated(room, well_known()).model_copy(update={"pose": None})
    np.testing.assert_array_equal(alone.bench_before(PLATE, room.size).covariance, usual.covariance)


def test_boards_say_nothing_of_a_camera_of_other_pixels(room):
    known = calibrated(room, well_known()).bench_before(PLATE, (room.size[0], room.size[1] + 2))
    np.testing.assert_array_equal(known.covariance, models.bench_before(PLATE).covariance)


def test_a_bench_that_boards_were_seen_on_comes_back_from_its_calibration(room):
    known = calibrated(room, well_known())
    bench = known.bench_before(PLATE, room.size)
    again = Calibration.model_validate_json(known.on_bench(bench).model_dump_json()).known_bench()
    assert again.measured == bench.measured == tuple(NUMBERS)
    np.testing.assert_array_equal(again.covariance, bench.covariance)
    entry = known.model_dump_json(exclude_none=True)
    np.testing.assert_array_equal(
        Calibration.model_validate_json(entry).known_lens().covariance, well_known()
    )

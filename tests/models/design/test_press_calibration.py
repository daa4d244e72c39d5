"""Known presses say where the camera really is and how soft the plate really is."""

from dataclasses import replace

import numpy as np
import pytest

import models
from models.design.press_calibration import PriorSigma, correct_by_presses

NOISE = 1.0  # grey levels
PLACES = np.array([(40, 30), (110, 30), (40, 80), (110, 80), (75, 55), (60, 70), (95, 45)], float)


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def pressed(rng, off=0.0):
    """Touches, and what is said of them: fingers are off by `off` mm."""
    true = np.column_stack([PLACES, rng.uniform(2.0, 3.0, len(PLACES))])
    said = true.copy()
    said[:, :2] += rng.normal(0, off, PLACES.shape)
    return true, said


def wrong(camera, modes, soft=1.1):
    """Take a camera 0.4 mm and 2 % off, and modes of a plate stiffer than the real one."""
    pose = camera.T_cam_plate.copy()
    pose[:2, 3] += (0.4, -0.3)
    seen = replace(camera, T_cam_plate=pose, focal=1.02 * camera.focal)
    return seen, replace(modes, stiffness=soft * modes.stiffness)


def learn(bench, assumed, rng, off=0.0, shift=(0.0, 0.0), hand=None, **given):
    camera, modes = assumed
    true, said = pressed(rng, off)
    images = [bench.image([touch], shift) for touch in true]
    images = [one + rng.normal(0, NOISE, one.shape) for one in images]
    if hand:
        for one in images:
            one[hand] = 140.0

    def look(seen):
        return models.prepare_motions(modes, seen, bench.height, bench.reference.tiles)

    return correct_by_presses(camera, look, bench.reference, images, said, (NOISE, 1e-3), **given)


def apart(camera, other, plate):
    """RMS distance of what two cameras see of points on a plate, px."""
    x, y = np.meshgrid(*(np.linspace(0, side, 5) for side in plate.size))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    return np.sqrt(np.mean(np.square(camera.project(points) - other.project(points)).sum(1)))


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.3, -0.2)])
def test_camera_and_softness_are_found(bench, rng, shift):
    assumed = wrong(bench.camera, bench.modes)
    found = learn(bench, assumed, rng, shift=shift)
    before = apart(assumed[0], bench.camera, bench.modes.plate)
    after = apart(found.camera, bench.camera, bench.modes.plate)
    assert before > 2.0 > 0.5 > after
    assert found.softness == pytest.approx(1.1, abs=4 * 1.1 * np.sqrt(found.covariance[-1, -1]))
    assert found.softness == pytest.approx(1.1, rel=0.03)
    assert found.p_value < 1e-9


def test_presses_that_are_off_themselves_cost_what_is_said_of_them(bench, rng):
    prior_sigma = PriorSigma(place=1.0)
    found = learn(bench, wrong(bench.camera, bench.modes), rng, off=1.0, prior_sigma=prior_sigma)
    exact = learn(bench, wrong(bench.camera, bench.modes), rng)
    assert (np.diag(found.covariance)[3:5] > 1.5 * np.diag(exact.covariance)[3:5]).all()
    a, b = bench.modes.plate.size
    middle = np.array([a / 2, b / 2, 0.0, 1.0])
    away = (found.camera.T_cam_plate @ middle - bench.camera.T_cam_plate @ middle)[:2]
    assert (np.abs(away) < 4 * np.sqrt(np.diag(found.covariance)[3:5])).all()


def test_a_hand_before_the_plate_is_left_out(bench, rng):
    hand = np.s_[20:140, 180:300]
    tiles = bench.reference.tiles
    x, y = tiles.xy.T
    covered = (np.abs(x - 240) < 66) & (np.abs(y - 80) < 66)
    given = {"hand": hand, "hidden": np.tile(covered, (len(PLACES), 1))}
    found = learn(bench, wrong(bench.camera, bench.modes), rng, **given)
    assert apart(found.camera, bench.camera, bench.modes.plate) < 0.6
    assert found.softness == pytest.approx(1.1, rel=0.04)


def test_a_bench_that_is_right_stays_so_within_its_uncertainty(bench, rng):
    found = learn(bench, (bench.camera, bench.modes), rng)
    assert apart(found.camera, bench.camera, bench.modes.plate) < 0.4
    assert found.p_value > 0.01
    assert np.log(found.softness) == pytest.approx(0.0, abs=4 * np.sqrt(found.covariance[-1, -1]))


def test_a_prior_weighs_against_the_presses_by_its_precision(bench):
    def softness(sigma):
        stiffer = replace(bench.modes, stiffness=1.02 * bench.modes.stiffness)
        rng, prior_sigma = np.random.default_rng(7), PriorSigma(softness=sigma)
        return learn(bench, (bench.camera, stiffer), rng, prior_sigma=prior_sigma)

    free = softness(10.0)
    information = 1.0 / free.covariance[-1, -1] - 10.0**-2
    held = softness(information**-0.5)
    assert np.log(held.softness) == pytest.approx(0.5 * np.log(free.softness), rel=0.1)
    assert held.covariance[-1, -1] == pytest.approx(0.5 * free.covariance[-1, -1], rel=0.1)


def test_a_press_without_its_image_is_refused(bench):
    image = [bench.image()]
    with pytest.raises(ValueError, match="2 known presses need an image each, got 1; give one"):
        correct_by_presses(
            bench.camera, None, bench.reference, image, np.ones((2, 3)), (NOISE, NOISE)
        )


def test_the_covariance_of_the_pose_is_that_of_the_plates_origin(bench, rng):
    found = learn(bench, (bench.camera, bench.modes), rng)
    draws = rng.multivariate_normal(np.zeros(6), found.covariance[:6, :6], 4000)
    pose = found.camera.T_cam_plate
    pivot = np.array([0.0, 0.0, found.camera.scale * found.camera.focal])
    origin = draws[:, 3:] + np.cross(draws[:, :3], pose[:3, 3] - pivot)
    sampled = np.cov(np.column_stack([draws[:, :3], origin]).T)
    sigma = np.sqrt(np.diag(sampled))
    np.testing.assert_allclose(
        found.pose_covariance / np.outer(sigma, sigma), sampled / np.outer(sigma, sigma), atol=0.08
    )

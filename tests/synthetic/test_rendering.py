"""Exact images: pixels integrate light, and each looks up its own material point."""

import numpy as np
import pytest

import synthetic

PLATE = (50.0, 36.0)
Z = 0.5
PATTERN = synthetic.Speckle(PLATE, seed=5).draw()
CAMERA = synthetic.pinhole_above(PLATE, stand_off=200.0, pixels=(208, 156))


def rendered(displacement=None, camera=CAMERA, samples=4):
    return synthetic.render(PATTERN, camera, displacement, None, None, Z, samples)


def test_pixel_integration_converges():
    best = rendered(samples=8)
    spread = {n: np.std(rendered(samples=n) - best) for n in (2, 3, 4)}
    assert spread[2] > 5 * spread[3] > 15 * spread[4]
    # Measured 0.009 grey levels of 255, worst pixel 0.08.
    assert spread[4] < 0.02
    assert abs(np.mean(rendered() - best)) < 1e-3


def test_a_shift_by_whole_pixels_shifts_the_image():
    step = (200.0 - Z) / CAMERA.focal
    moved = rendered(lambda points: np.tile([3 * step, -2 * step, 0.0], (len(points), 1)))
    # Plate y runs up, so −2 pixels in y are two rows down.
    assert np.allclose(moved[2:, 3:], rendered()[:-2, :-3], atol=1e-9)


def affine_points(camera, px, F, b, w0, g):
    """Solve X + FX + b on the ray of each pixel, at height Z + w0 + g·X, in closed form."""
    R, position = camera.T_cam_plate[:3, :3], camera.position
    rays = np.column_stack([(px - camera.centre) / camera.focal, np.ones(len(px))]) @ R
    A = np.zeros((len(px), 3, 3))
    A[:, :2, :2] = np.eye(2) + F
    A[:, 2, :2] = g
    A[:, :, 2] = -rays
    right = position - [*b, Z + w0]
    return np.linalg.solve(A, np.tile(right, (len(px), 1))[..., None])[:, :2, 0]


def tilted(tilt):
    pose = synthetic.rotated(CAMERA.T_cam_plate, tilt, (25.0, 18.0, 0.0))
    return synthetic.Camera(CAMERA.size, 700.0, (100.0, 80.0), pose)


def exactly(camera, F, b, w0, g):
    """Image of an affine displacement by its closed form, with 6 × 6 points a pixel."""
    nodes, weights = np.polynomial.legendre.leggauss(6)
    grid = np.stack(np.meshgrid(np.arange(208.0), np.arange(156.0)), axis=-1).reshape(-1, 2)
    light = 0
    for x, wx in zip(nodes / 2, weights / 2, strict=True):
        for y, wy in zip(nodes / 2, weights / 2, strict=True):
            points = affine_points(camera, grid + np.array([x, y]), F, b, w0, g)
            light = light + 255 * wx * wy * PATTERN.intensity(points)
    return light.reshape(156, 208)


def turn(degrees):
    angle = np.radians(degrees)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


BENT = np.array([[0.02, 0.01], [-0.015, 0.03]])
STRETCHED = np.array([[0.5, 0.1], [-0.05, -0.3]])


@pytest.mark.parametrize("tilt", [(0.0, 0.0, 0.0), (0.25, -0.15, 0.3)])
@pytest.mark.parametrize("F", [BENT, STRETCHED, turn(170) - np.eye(2), 1.5 * turn(-80) - np.eye(2)])
def test_an_affine_displacement_shows_the_points_of_the_closed_form(tilt, F):
    camera, middle, w0, g = tilted(tilt), np.array([25.0, 18.0]), -0.5, np.array([0.02, -0.03])
    b = np.array([0.3, -0.4]) - F @ middle

    def displacement(points):
        return np.column_stack([points @ F.T + b, w0 + points @ g])

    expected = exactly(camera, F, b, w0, g)
    # 1e-4 px at the steepest edge of a spot is 0.02 grey levels; measured 1e-5.
    assert np.abs(rendered(displacement, camera, samples=6) - expected).max() < 1e-3
    # The pixels themselves: a spot that is pressed to 0.7 of its width needs 5 samples a side.
    bias = tile_bias(expected, rendered(displacement, camera, samples=5) - expected)
    assert np.abs(bias).max() < 1e-4


def tile_bias(exact, error, side=21):
    """Displacement, px, that least squares on each tile with a pattern reads out of the error."""
    slopes, found = np.stack(np.gradient(exact)[::-1], axis=-1), []
    for top in range(10, exact.shape[0] - 10 - side, side):
        for left in range(10, exact.shape[1] - 10 - side, side):
            tile = np.s_[top : top + side, left : left + side]
            if exact[tile].std() > 40:
                A, b = slopes[tile].reshape(-1, 2), -error[tile].ravel()
                found.append(np.linalg.lstsq(A, b, rcond=None)[0])
    assert len(found) > 5
    return np.array(found)


def test_a_known_pixel_shows_the_point_that_moved_into_it():
    def displacement(points):
        w = -np.sin(np.pi * points[:, 0] / 50) * np.sin(np.pi * points[:, 1] / 36)
        return np.column_stack([0.05 * w, -0.03 * w, w])

    # One sample a pixel: the light of the pixel is the light of the material point itself.
    image = rendered(displacement, samples=1)
    inside = np.random.default_rng(2).uniform((2, 2), (48, 34), (5000, 2))
    moved = CAMERA.project(
        np.column_stack([inside, np.full(len(inside), Z)]) + displacement(inside)
    )
    column, row = np.round(moved).astype(int).T
    away = np.linalg.norm(moved - np.round(moved), axis=1)
    error = np.abs(image[row, column] - 255 * PATTERN.intensity(inside))
    # The edge of a spot is at most 15/8 of its mean slope steep; two spots may add up.
    steepest = 255 * 2 * 15 / 8 * CAMERA.scale / PATTERN.speckle.edge
    assert away.min() < 0.01
    assert np.all(error < 0.05 + steepest * away)


def test_the_default_exposure_spreads_over_50_to_56_levels_and_saturates_nothing():
    image = synthetic.render(PATTERN, CAMERA, None, synthetic.Sensor(), np.random.default_rng(0), Z)
    assert image.dtype == np.uint8
    assert image.shape == (156, 208)
    assert image.min() > 0
    assert image.max() < 255
    assert 50 < image[15:-15, 15:-15].std() < 56


def test_a_seed_repeats_the_image():
    first, again = (
        synthetic.render(PATTERN, CAMERA, None, synthetic.Sensor(), np.random.default_rng(4), Z)
        for _ in range(2)
    )
    assert np.array_equal(first, again)


def away(x: float) -> synthetic.Camera:
    pose = CAMERA.T_cam_plate.copy()
    pose[0, 3] += x
    return synthetic.Camera(CAMERA.size, CAMERA.focal, CAMERA.centre, pose)


def folded(points):
    x = points[:, 0] - 25
    return np.column_stack([-4 * np.tanh(x), 0 * x, 0 * x])


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: rendered(lambda points: points), r"must return \(\d+, 3\) mm"),
        (lambda: rendered(lambda points: np.full((len(points), 3), np.nan)), "must be finite"),
        (lambda: rendered(folded), "folds the image in"),
        (lambda: rendered(lambda p: np.tile([0, 0, 300.0], (len(p), 1))), "in front of the camera"),
        (lambda: rendered(camera=away(90.0)), "outside the image"),
        (
            lambda: synthetic.render(PATTERN, CAMERA, None, None, None, 250.0),
            "in front of the camera",
        ),
    ],
)
def test_bad_input_is_named_in_one_sentence(call, sentence):
    with pytest.raises(ValueError, match=sentence):
        call()

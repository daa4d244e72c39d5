"""What a camera sees that stands or bends rays otherwise than said, and of a thicker plate."""

import numpy as np
import pytest

import dic
import fe
import models
import synthetic
from dic import lay_tiles
from models.forward.image_motion import plate_motions

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
HEIGHT = 0.5  # mm
CAMERA = synthetic.pinhole_above(PLATE.size, 300.0, (120, 90))
MOVED = np.array([0.004, -0.003, 0.002, 0.5, -0.4, 0.8, 0.004, -0.02, 0.01])
STEPS = np.array([1e-4, 1e-4, 1e-4, 0.01, 0.01, 0.01, 1e-4, 3e-4, 3e-4])


@pytest.fixture(scope="module")
def look():
    modal = fe.modal_plate(PLATE, 24, fe.grid(PLATE, 12))
    fields = models.BenchFields(fe.BenchPlate(modal, fe.bench_values()))
    tiles = lay_tiles((90, 120), 6)
    motions = models.prepare_motions(fields, CAMERA, HEIGHT, tiles, fields, models.with_tilts)
    rng = np.random.default_rng(4)
    image = synthetic.speckle(size=PLATE.size, diameter=3.0, density=0.5, softness=0.75, seed=4)
    rest = synthetic.prepare_warp(image, CAMERA, HEIGHT)
    rest = rest.render(np.zeros((len(rest.points), 3)), synthetic.Sensor(noise=1.0, bits=8), rng)
    reference = dic.prepare_tiles(rest.astype(np.float32), 6)
    pattern = models.prepare_pattern(motions, reference)
    return models.CameraChange(pattern, fields.whole, CAMERA, HEIGHT)


@pytest.fixture(scope="module")
def seen(look):
    return look.at(MOVED)


@pytest.fixture(scope="module")
def pressed(look):
    """Amplitudes of the plate under a touch."""
    return look.fields.bench.press(np.array([[60.0, 50.0, 2.0]])).values


def image_motion(look, amplitudes, camera, height):
    """Motion of the tiles' middles of the plate, by projection before and after, px."""
    xy = camera.on_plate(look.pattern.motions.tiles.xy, height)
    on = ((xy > 12.0) & (xy < np.array(PLATE.size) - 12.0)).all(axis=1)
    fields, count = look.fields, look.fields.count
    slope = fields.slope(xy[on])
    along = -height * np.einsum("nkd,k->nd", slope, amplitudes[:count])
    along += fields.drift(xy[on]) @ amplitudes[count:]
    rest = np.column_stack([xy[on], np.full(on.sum(), height)])
    after = rest + np.column_stack([along, fields.value(xy[on]) @ amplitudes[:count]])
    return on, camera.project(after) - camera.project(rest)


def tile_motion(look, amplitudes, values):
    """Mean motion of all tiles by the plate, through a camera with these numbers, (2T,) px."""
    camera, tiles = models.varied(CAMERA, (75.0, 55.0, 0.0), values), look.pattern.motions.tiles
    by_field = plate_motions(look.fields, camera, HEIGHT, tiles, look.fields)
    return by_field.reshape(-1, len(amplitudes)) @ amplitudes


def resolved(look, rows, motion):
    """Return what an image takes a motion of its tiles for."""
    tiles = rows.T.reshape(len(motion) // 2, -1)
    smooth = look.pattern.motions.spread.smooth_adjoint(tiles)
    return smooth.reshape(len(motion), -1).T @ motion


@pytest.mark.parametrize("thicker", [0.0, 0.05])
def test_it_is_what_projection_of_the_moved_plate_gives(look, pressed, thicker):
    small = 1e-3 * pressed  # so that the motion is linear
    camera = models.varied(CAMERA, (75.0, 55.0, 0.0), MOVED)
    on, true = image_motion(look, small, camera, HEIGHT * np.exp(thicker))
    found, basis = look.at(MOVED, thicker).matrix @ small, look.pattern.motions.tile_basis()
    rigid = basis[on][:, :, len(found) :].reshape(-1, basis.shape[2] - len(found))
    found = basis[on][:, :, : len(found)] @ found
    # A shift of the camera is no amplitude of the plate: what looks like one stands aside.
    left = (true - found).ravel()
    left -= rigid @ np.linalg.lstsq(rigid, left, rcond=None)[0]
    assert np.sqrt(np.mean(left**2)) < 0.02 * np.sqrt(np.mean(true**2))


@pytest.mark.parametrize("k", range(9))
def test_derivatives_by_the_camera(look, seen, pressed, k):
    change = np.zeros(len(MOVED))
    change[k] = STEPS[k]
    # What a camera leaves is taken off the image alike, so it is no part of the derivative.
    like_camera = resolved(look, look.pattern.resolving_camera, tile_motion(look, pressed, MOVED))
    ahead, behind = (
        there.matrix @ pressed + there.uneven @ like_camera
        for there in (look.at(MOVED + sign * change) for sign in (1.0, -1.0))
    )
    numeric = (ahead - behind) / (2.0 * STEPS[k])
    exact = seen.derivatives[k] @ pressed
    # As the camera turns, tiles beside the plate come near enough to count, one after the other.
    assert np.abs(numeric - exact).max() < 5e-3 * np.abs(numeric).max()


def test_derivative_by_the_thickness(look, seen, pressed):
    ahead, behind = (look.at(MOVED, step).matrix @ pressed for step in (0.005, -0.005))
    numeric = (ahead - behind) / 0.01
    exact = seen.by_thickness @ pressed
    assert np.abs(numeric - exact).max() < 1e-3 * np.abs(numeric).max()


def test_a_camera_as_described_sees_the_fields_that_are_measured(look):
    matrix = look.at(np.zeros(len(MOVED))).matrix
    details = look.fields.detailed
    measured = np.delete(matrix, np.s_[look.fields.count - details : look.fields.count], axis=1)
    np.testing.assert_allclose(measured[:, : len(matrix)], np.eye(len(matrix)), atol=2e-4)


def test_a_camera_at_a_slant_with_a_lens_moves_the_image_as_it_is_projected():
    middle, height, rng = (75.0, 55.0, 0.0), 1.0, np.random.default_rng(4)
    off = models.varied(CAMERA, middle, MOVED)
    px = rng.uniform(20.0, np.array(CAMERA.size) - 20.0, (40, 2))
    points = np.column_stack([off.on_plate(px, height), np.full(len(px), height)])
    basis = models.moving(MOVED, middle, height)(CAMERA, px).reshape(2 * len(px), -1)
    drift = np.concatenate([rng.normal(0.0, 1e-4, 3), rng.normal(0.0, 0.02, 3), np.zeros(3)])
    moved = (models.varied(CAMERA, middle, MOVED + drift).project(points) - px).ravel()
    left, evenly = (
        moved - some @ np.linalg.lstsq(some, moved, rcond=None)[0]
        for some in (basis, models.with_tilts(CAMERA, px).reshape(2 * len(px), -1))
    )
    assert np.abs(left).max() < 0.1 * np.abs(evenly).max()
    assert np.abs(left).max() < 2e-3 * np.abs(moved).max()


def test_what_is_left_of_a_camera_at_a_slant_that_moves_is_predicted(look, seen):
    middle, px = (75.0, 55.0, 0.0), look.pattern.motions.tiles.xy
    off = models.varied(CAMERA, middle, MOVED)
    points = np.column_stack([off.on_plate(px, HEIGHT), np.full(len(px), HEIGHT)])
    drift = np.array([1e-4, -2e-4, 1e-4, 0.02, -0.03, 0.01, 0.0, 0.0, 0.0])
    moved = (models.varied(CAMERA, middle, MOVED + drift).project(points) - px).ravel()
    basis = models.with_tilts(CAMERA, px).reshape(len(moved), -1)
    by_camera = np.linalg.lstsq(basis, moved, rcond=None)[0]
    taken = resolved(look, look.pattern.resolving, moved)
    assert np.linalg.norm(taken - seen.uneven @ by_camera) < 0.15 * np.linalg.norm(taken)
    even = resolved(look, look.pattern.resolving, basis @ by_camera)
    assert np.linalg.norm(even) < 0.1 * np.linalg.norm(taken)


def test_motion_of_the_plate_that_looks_like_a_camera_is_taken_off_both(look, seen, pressed):
    """Off an image as what a camera left that moved, and off what is predicted of the plate."""
    small = 1e-3 * pressed
    motion = tile_motion(look, small, MOVED)
    taken_off = seen.uneven @ resolved(look, look.pattern.resolving_camera, motion)
    left = resolved(look, look.pattern.resolving, motion) - taken_off - seen.matrix @ small
    # What is left beside it is how a tile's mean differs from its middle through this camera.
    assert abs(left @ taken_off) < 0.2 * (taken_off @ taken_off)


def test_a_camera_as_described_moves_the_image_by_shifts_turns_and_tilts():
    px = np.random.default_rng(5).uniform(20.0, np.array(CAMERA.size) - 20.0, (40, 2))
    found = models.moving(np.zeros(9), (75.0, 55.0, 0.0), 1.0)(CAMERA, px)
    wanted = models.with_tilts(CAMERA, px)
    scale = np.abs(wanted).max(axis=(0, 1))
    np.testing.assert_allclose(found / scale, wanted / scale, atol=1e-4)

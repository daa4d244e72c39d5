"""Gray code: every pixel of the projector is found on the plate."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rig.calibration.projector import find_light
from rig.projector.gray_code import bits, decode, patterns
from rig.projector.markers import project

PROJECTOR = (200, 150)  # px
T = np.array([[0.66, 0.02, 14.0], [-0.015, -0.63, 139.0], [1.2e-4, -0.8e-4, 1.0]])
PLATE = (254.0, 203.0)


@given(st.integers(2, 70), st.integers(2, 40))
def test_every_pixel_is_reported_from_every_other(width, height):
    images = patterns((width, height))
    assert len(images) == 2 + 2 * sum(bits((width, height)))
    seen, valid = decode(images, (width, height))
    assert valid.all()
    np.testing.assert_array_equal(seen[0, :, 0], np.arange(width))
    np.testing.assert_array_equal(seen[:, 0, 1], np.arange(height))


def test_neighbours_differ_in_one_image_and_its_inverse_only():
    images = np.stack(patterns((64, 40))).astype(int)
    for axis in (1, 2):
        changes = np.count_nonzero(np.diff(images, axis=axis), axis=0)
        assert (changes == 2).all()


def test_what_is_not_lit_is_not_read(rng):
    images = [40 + 0.1 * image for image in patterns((64, 40))]
    for image in images:
        image[10:20, 30:50] = 40 + rng.normal(0, 2, (10, 20))
    _, valid = decode(images, (64, 40))
    assert valid.mean() == pytest.approx(1 - 200 / (64 * 40), abs=0.02)
    assert valid[10:20, 30:50].mean() < 0.2


def test_a_missing_image_is_refused():
    with pytest.raises(ValueError, match="has 28 pictures, got 25; take one of each pattern"):
        decode(patterns((64, 40))[:-1], (64, 80))


@pytest.fixture(scope="module")
def lit(room):
    """Light the plate with each pattern, over room light and speckle."""
    rng = np.random.default_rng(2)
    camera = room.camera_at((127.0, 101.0, 460.0), (127.0, 101.0, 0.0))
    places = room.places_seen(camera, 1.0)
    inside = ((places >= 0) & (places <= PLATE)).all(axis=-1)
    grain = rng.uniform(0.4, 1.0, places.shape[:2])[..., None] * inside
    px = project(T, places.reshape(-1, 2)).reshape(places.shape)
    images = [
        room.photograph((30 + grain * (20 + 0.5 * room.look_up(p, px))).mean(axis=2), rng)
        for p in patterns(PROJECTOR)
    ]
    return camera, images


def test_the_projector_is_found_to_0_3_mm_and_says_so(lit):
    camera, images = lit
    light = find_light(*decode(images, PROJECTOR), camera, PLATE, PROJECTOR, 1.0)
    grid = np.stack(np.meshgrid(np.linspace(5, 249, 8), np.linspace(5, 198, 8)), -1).reshape(-1, 2)
    shown = project(light.screen.T_px_plate, grid)
    fallen = project(np.linalg.inv(T), shown)  # where the light really falls
    away = np.linalg.norm(fallen - grid, axis=1)
    assert away.max() < 0.3  # mm; a pixel of this projector is 1.5 mm
    assert np.sqrt(np.mean(away**2)) < max(2 * light.error, 0.15)
    assert light.error < 0.3
    assert light.fraction > 0.6
    assert light.screen.size == PROJECTOR


def test_a_projector_that_is_off_is_one_sentence(lit):
    camera, images = lit
    dark = [images[1]] * len(images)
    with pytest.raises(ValueError, match="lights 0 pixels of the plate, and 1000 are needed"):
        find_light(*decode(dark, PROJECTOR), camera, PLATE, PROJECTOR, 1.0)

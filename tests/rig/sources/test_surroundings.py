"""What surrounds a plate: each thing changes what it should, when it should."""

import numpy as np
import pytest

import fe
import synthetic
from rig.sources.surroundings import CROSSING, Surrounded, Surroundings

PLATE, PIXELS = (254.0, 203.0), (320, 256)
FINGER = (fe.Touch(90.0, 80.0, 2.0),)


@pytest.fixture
def around():
    camera = synthetic.pinhole_above(PLATE, 500.0, PIXELS)

    def build(**sizes):
        return Surrounded(Surroundings(**sizes), camera, PLATE, 0.5, seed=3)

    return build


@pytest.fixture
def light():
    """Speckles of soft spots, (H, W)."""
    return np.random.default_rng(4).uniform(0.2, 0.9, PIXELS[::-1]).astype(np.float32)


def rng():
    return np.random.default_rng(5)


def test_nothing_around_changes_nothing(around, light):
    seen = around().expose(light, 3.0, FINGER, rng())
    np.testing.assert_array_equal(seen, light)
    image = np.arange(256, dtype=np.uint8).reshape(16, 16)
    around().soil(image)
    np.testing.assert_array_equal(image, np.arange(256).reshape(16, 16))


@pytest.mark.parametrize(
    "sizes", [{"brighter": 0.2}, {"shadow": 0.4}, {"defocus": 2}, {"hand": 60}]
)
def test_what_comes_after_the_reference_is_not_in_it(around, light, sizes):
    here = around(**sizes)
    np.testing.assert_array_equal(here.expose(light, None, FINGER, rng()), light)
    assert np.abs(here.expose(light, 0.0, FINGER, rng()) - light).max() > 0.05


def test_a_lamp_grows_and_a_shadow_crosses(around, light):
    brighter = around(brighter=0.2).expose(light, 1.0, (), rng())
    np.testing.assert_allclose(brighter, 1.2 * light, rtol=1e-6)
    shaded = around(shadow=0.4)
    for phase in (0.25, 0.5, 0.75):
        left = (shaded.expose(light, phase * CROSSING, (), rng()) / light).mean(axis=0)
        assert int(np.argmin(left)) == pytest.approx(phase * PIXELS[0], abs=6)
        assert left.min() == pytest.approx(0.6, abs=0.02)
        assert left.max() == pytest.approx(1.0, abs=0.02)


def test_light_flickers_as_it_is_said_to(around, light):
    here, own = around(flicker=0.03), rng()
    gains = [float((here.expose(light, None, (), own) / light).mean()) for _ in range(400)]
    assert np.mean(gains) == pytest.approx(1.0, abs=4 * 0.03 / 20)
    assert np.std(gains) == pytest.approx(0.03, rel=4 / np.sqrt(800))


def test_a_hand_hides_what_lies_behind_the_finger(around, light):
    here = around(hand=50.0)
    seen = here.expose(light, 0.0, FINGER, rng())
    hidden = np.abs(seen - light) > 1e-6
    finger = here.camera.project(np.array([[90.0, 80.0, 0.5]]))[0]
    row, column = np.nonzero(hidden)
    away = np.hypot(column - finger[0], row - finger[1])
    per_mm = np.ptp(here.camera.project(np.array([[0, 0, 0.5], [1.0, 0, 0.5]]))[:, 0])
    assert away.min() > 4.0 * per_mm  # the pressed place is seen
    assert hidden[:, -1].any()  # and the arm leaves the image
    np.testing.assert_array_equal(here.expose(light, 0.0, (), rng()), light)  # no finger, no hand


def test_clamps_are_seen_beside_the_plate_alone(around, light):
    here = around(clamps=2.0)
    seen = here.expose(light, None, (), rng())
    corners = np.array([[0, 0, 0.5], [254.0, 203.0, 0.5]])
    (x0, y0), (x1, y1) = np.sort(here.camera.project(corners), axis=0)
    y, x = np.indices(light.shape)
    inside = (x > x0 + 1) & (x < x1 - 1) & (y > y0 + 1) & (y < y1 - 1)
    outside = (x < x0 - 1) | (x > x1 + 1) | (y < y0 - 1) | (y > y1 + 1)
    np.testing.assert_array_equal(seen[inside], light[inside])
    assert (seen[outside] == 2.0).all()
    assert outside.any()


def test_dirt_is_the_same_in_every_image(around):
    here = around(fixed_pattern=3.0)
    grey = np.full(PIXELS[::-1], 120, np.uint8)
    first, second = grey.copy(), grey.copy()
    for image in (first, second):
        here.soil(image)
    np.testing.assert_array_equal(first, second)
    off = first.astype(float) - 120
    assert off.mean() == pytest.approx(0.0, abs=4 * 3 / np.sqrt(off.size))
    assert off.std() == pytest.approx(np.hypot(3.0, np.sqrt(1 / 12)), rel=4 / np.sqrt(2 * off.size))

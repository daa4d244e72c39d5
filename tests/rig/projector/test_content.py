"""Everything that the projector can be asked to show."""

import numpy as np
import pytest

from rig.live.snapshot import Mark
from rig.projector import gray_code
from rig.projector.content import Plain, Stripe, draw, image_of
from rig.projector.markers import draw_marks, fit_plate

SCREEN = fit_plate((50, 30), (254.0, 180.0))


@pytest.mark.parametrize("number", range(gray_code.count((50, 30))))
def test_a_stripe_is_the_image_of_its_number_in_white(number):
    image = draw(Stripe(number), SCREEN)
    assert image.shape == (30, 50, 3)
    for channel in range(3):
        np.testing.assert_array_equal(image[..., channel], gray_code.patterns((50, 30))[number])


def test_plain_light_and_marks():
    assert (draw(Plain(200), SCREEN) == 200).all()
    marks = (Mark(100.0, 90.0, 2.0),)
    np.testing.assert_array_equal(draw(marks, SCREEN), draw_marks(marks, SCREEN))
    assert not draw((), SCREEN).any()


def test_an_image_is_drawn_as_it_is_and_a_grey_one_in_white():
    rng = np.random.default_rng(3)
    colour, grey = (
        rng.integers(0, 256, (30, 50, 3), np.uint8),
        rng.integers(0, 256, (30, 50), np.uint8),
    )
    np.testing.assert_array_equal(draw(image_of(colour, (50, 30)), SCREEN), colour)
    for channel in range(3):
        np.testing.assert_array_equal(draw(image_of(grey, (50, 30)), SCREEN)[..., channel], grey)

"""Noise of the images of a test: that which was added, also where a print is sharp."""

import cv2
import numpy as np
import pytest

from rig.series.noise import image_noise, noise_between


def discs(shift):
    """Draw hard discs that stand on a ground, moved by (x, y) px, (190, 250), grey levels."""
    rng, fine = np.random.default_rng(3), 16
    image = np.full((190 * fine, 250 * fine), 200, np.uint8)
    for x, y in rng.uniform(-5, [255, 195], (1500, 2)):
        centre = round(fine * (x + shift[0])), round(fine * (y + shift[1]))
        cv2.circle(image, centre, round(2.4 * fine), 60, cv2.FILLED)
    return cv2.resize(image, (250, 190), interpolation=cv2.INTER_AREA).astype(float)


@pytest.fixture(scope="module")
def pair():
    return discs((0, 0)), discs((0.5, 0.25))


def noisy(image, noise, seed):
    return image + np.random.default_rng(seed).normal(0, noise, image.shape)


@pytest.mark.parametrize("noise", [2.0, 8.0])
def test_noise_is_that_which_was_added(pair, noise):
    first, second = (
        noisy(cv2.GaussianBlur(im, (0, 0), 1.0), noise, n) for n, im in enumerate(pair)
    )
    assert 0.9 < noise_between(first, second) / noise < 1.25


def test_what_a_sharp_print_aliases_counts_as_noise(pair):
    first, second = (noisy(image, 2.0, n) for n, image in enumerate(pair))
    found = image_noise(first, second, "b.png")
    assert 2.0 < found.level < 6.0
    assert found.source == "from what b.png leaves over"


def test_the_spectrum_gives_a_bound_where_no_frame_is_of_use(pair):
    first = noisy(pair[0], 8.0, 5)
    for frame in (None, first[:50], np.zeros_like(first), first[::-1].copy()):
        found = image_noise(first, frame, "b.png")
        assert "lower bound" in found.source
        assert 0 < found.level < 9.0

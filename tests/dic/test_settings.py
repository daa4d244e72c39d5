"""Quality of a pattern: size of its spots, sub-pixel bias, and the subset that it asks for."""

import numpy as np
import pytest

import dic


@pytest.fixture(scope="module")
def large(speckle):
    return speckle((240, 310), seed=21)


@pytest.fixture(scope="module")
def image(large):
    return large.draw()


@pytest.mark.parametrize("noise", [0.0, 8.0])
def test_speckle_size_is_the_diameter_of_the_spots(image, noise):
    seen = image + np.random.default_rng(0).normal(0, noise, image.shape)
    # Drawn 4.5 px wide; a pixel adds 0.2. Measured 4.6.
    assert dic.speckle_size(seen) == pytest.approx(4.65, abs=0.35)


def test_speckle_size_of_an_image_twice_as_large_is_twice_as_large(image):
    twice = np.repeat(np.repeat(image, 2, axis=0), 2, axis=1)
    assert dic.speckle_size(twice) / dic.speckle_size(image) == pytest.approx(2, rel=0.06)


def test_mean_intensity_gradient_of_a_slope_is_its_steepness():
    y, x = np.mgrid[:60, :80]
    slope = np.hypot(3, 4)
    # Mirrored at the border, the slope turns there; the spline rings for some px.
    assert dic.mean_intensity_gradient(3.0 * x + 4.0 * y) == pytest.approx(slope, rel=0.05)


def test_sub_pixel_bias_is_that_of_exact_images(large, image):
    shifts = (0.25, 0.75)
    said = dic.sub_pixel_bias(image, 21, shifts)
    assert said.shape == (2, 2)
    assert np.abs(said).max() < 3e-4
    hard = np.where(image > 128, 200.0, 50.0)  # edges that no camera resolves
    assert np.abs(dic.sub_pixel_bias(hard, 21, shifts)).max() > 3 * np.abs(said).max()


@pytest.mark.parametrize("sigma", [0.02, 0.008])
def test_chosen_subset_measures_to_the_sigma_asked_for(large, image, sigma):
    rng = np.random.default_rng(1)
    first, second = (i + rng.normal(0, 3, i.shape) for i in (image, large.draw((0.3, 0.4))))
    advice = dic.recommend_settings(first, noise=3.0, sigma=sigma)
    assert advice.sigma <= sigma
    assert advice.subset >= 3 * advice.speckle
    disp = dic.correlate(dic.prepare(first, advice.subset, advice.step), second)
    off = disp.u[disp.valid] - 0.3
    assert off.std() <= 1.1 * sigma
    smaller = advice.subset > 1.5 * 3 * advice.speckle
    assert off.std() >= 0.5 * sigma or not smaller


def test_a_pattern_too_weak_for_the_camera_is_named(image):
    weak = 128 + 0.01 * (image - 128)
    said = r"no subset up to 101 px measures to 0\.001 px.*; give the pattern .* subset yourself"
    with pytest.raises(ValueError, match=said):
        dic.recommend_settings(weak, noise=5.0, sigma=0.001)


def test_an_image_without_spots_is_named():
    with pytest.raises(ValueError, match="no spots"):
        dic.speckle_size(np.random.default_rng(0).normal(0, 1, (80, 90)))

"""What a pattern that stands still adds to the sums of tiles, against one that is drawn."""

import numpy as np
import pytest

import dic

LEVEL = 8.0  # grey levels


def drawn(sigma):
    """Draw a reference that is nothing but a pattern of the sensor."""
    rng = np.random.default_rng(4)
    image = 128.0 + LEVEL * rng.standard_normal((420, 560))
    return dic.prepare_tiles(image, 16, sigma), image


@pytest.mark.parametrize("sigma", [0.0, 0.8])
@pytest.mark.parametrize(
    "motion", [(0.05, -0.03), (0.5, 0.3), (-0.7, 1.2), (1.6, 0.0), (-3.2, 2.1)]
)
def test_sums_are_those_of_noise_that_is_moved_over_itself(sigma, motion):
    reference, image = drawn(sigma)
    flow = np.tile(motion, (len(reference.hessian), 1))
    sums = dic.tile_sums(reference, image, flow)
    gradient, unexplained = dic.fixed_pattern_sums(reference, flow)
    scatter = sums.gradient.std(axis=0) / np.sqrt(len(flow))
    steep = LEVEL**2 * np.abs(gradient).max()
    for seen, expected, sure in zip(
        sums.gradient.mean(axis=0), LEVEL**2 * gradient.mean(axis=0), scatter, strict=True
    ):
        assert seen == pytest.approx(expected, abs=4 * sure + 0.02 * steep)
    assert sums.ee.mean() == pytest.approx(LEVEL**2 * unexplained.mean(), rel=0.02)


def test_at_rest_it_adds_nothing_and_pulls_back_what_moved():
    reference, _ = drawn(0.0)
    flow = np.zeros((len(reference.hessian), 2))
    gradient, unexplained = dic.fixed_pattern_sums(reference, flow)
    assert np.abs(gradient).max() < 1e-9
    assert np.abs(unexplained).max() < 1e-9
    flow[::2] = 0.3
    flow[1::2] = -0.3
    gradient, unexplained = dic.fixed_pattern_sums(reference, flow)
    assert (gradient * flow > 0.0).all()  # the motion left over obeys H δ = -Σ∇f·e
    assert (unexplained > 0.0).all()


def test_a_motion_that_is_none_is_refused():
    reference, _ = drawn(0.0)
    with pytest.raises(ValueError, match=r"flow must be \(\d+, 2\) finite px"):
        dic.fixed_pattern_sums(reference, np.full((len(reference.hessian), 2), np.nan))

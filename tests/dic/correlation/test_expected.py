"""σ before there is a frame: that which the error of the frame turns out to have."""

import numpy as np
import pytest

import dic

SHIFT, STRETCH = (0.4, -0.3), ((1e-3, 0.0), (0.0, -1e-3))


def noisy(image, noise, seed):
    return image + np.random.default_rng(seed).normal(0, noise, image.shape)


@pytest.mark.parametrize(
    ("subset", "noise", "prefilter"), [(15, 2.0, None), (31, 8.0, None), (21, 4.0, 0.8)]
)
def test_expected_sigma_is_the_scatter_of_the_error(pattern, subset, noise, prefilter):
    drawn = []
    for seed in range(1, 11, 2):
        ref = dic.prepare(noisy(pattern.draw(), noise, seed), subset, 7, prefilter=prefilter)
        found = dic.correlate(ref, noisy(pattern.draw(SHIFT, STRETCH), noise, seed + 1))
        off = np.column_stack([found.u, found.v])
        off -= pattern.displacement(found.xy, SHIFT, STRETCH)
        drawn.append(off / dic.expected_sigma(ref, noise))
    in_sigma = np.array(drawn)
    measured = np.isfinite(in_sigma)
    assert measured.mean() > 0.95  # those at the border move out
    assert 0.85 < np.sqrt(np.mean(np.square(in_sigma[measured]))) < 1.1


def test_the_noise_of_the_reference_stands_in_for_one_that_is_not_given(pattern):
    ref = dic.prepare(noisy(pattern.draw(), 4.0, 1), 21, 7)
    ratio = dic.expected_sigma(ref) / dic.expected_sigma(ref, 4.0)
    np.testing.assert_allclose(ratio, ratio[0, 0], rtol=0.01)
    assert 0.85 < ratio[0, 0] < 1.15


def test_a_point_that_will_not_be_measured_has_none_and_no_noise_is_refused(pattern):
    image = noisy(pattern.draw(), 2.0, 1)
    image[:60] = 0.0
    ref = dic.prepare(image, 21, 7, prefilter=0.0)
    expected = dic.expected_sigma(ref, 2.0)
    np.testing.assert_array_equal(np.isnan(expected[:, 0]), ref.status != dic.Status.OK)
    assert np.isnan(expected).any()
    with pytest.raises(ValueError, match="give that of the camera"):
        dic.expected_sigma(ref)

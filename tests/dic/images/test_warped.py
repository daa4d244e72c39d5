"""An image that is read back from where its pixels have moved."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates

import dic

IMAGE = 128 + 200 * gaussian_filter(np.random.default_rng(3).normal(0, 1, (57, 72)), 1.7)


def test_it_reads_what_another_spline_of_the_same_degree_reads():
    y, x = np.indices(IMAGE.shape).astype(float)
    motion = np.stack([0.5 * np.cos(y / 4) + 2.3, 0.3 * np.sin(x / 7) - 1.6])
    found = dic.warp_image(dic.spline_coefficients(IMAGE), motion)
    other = map_coordinates(IMAGE, [y + motion[1], x + motion[0]], order=5)
    # Both go on in another way beyond the border, which a quintic forgets within some pixels.
    assert np.abs(found - other)[14:-14, 14:-14].max() < 1e-2


def test_it_is_the_image_itself_where_nothing_moves_and_never_leaves_it():
    spline = dic.spline_coefficients(IMAGE)
    assert np.abs(dic.warp_image(spline, np.zeros((2, *IMAGE.shape))) - IMAGE).max() < 1e-2
    far = dic.warp_image(spline, np.full((2, *IMAGE.shape), 1e4))
    assert np.ptp(far) == 0


def test_a_motion_that_is_not_known_is_refused():
    motion = np.zeros((2, *IMAGE.shape))
    motion[0, 3, 4] = np.nan
    with pytest.raises(ValueError, match="motion holds NaN"):
        dic.warp_image(dic.spline_coefficients(IMAGE), motion)


@pytest.mark.parametrize("shape", [(2, 72, 57), (57, 72), (2, 57, 72, 1)])
def test_a_motion_of_another_image_is_refused(shape):
    with pytest.raises(ValueError, match=r"motion must be \(2, H, W\) px"):
        dic.warp_image(dic.spline_coefficients(IMAGE), np.zeros(shape))

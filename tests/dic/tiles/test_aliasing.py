"""What interpolation and aliasing leave of a motion."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as arrays

import dic

MOTIONS = arrays.arrays(
    np.float64,
    st.tuples(st.integers(1, 9), st.just(2)),
    elements=st.floats(-3.0, 3.0, allow_subnormal=False),
)


def test_whole_pixels_leave_nothing():
    flow = np.array([[1.0, -2.0], [0.0, 3.0], [0.0, 0.0]])
    assert dic.aliasing_left(flow) < 1e-30
    assert abs(dic.gain_left(flow)) < 1e-15


def test_half_a_pixel_along_both_axes_leaves_all_of_each():
    assert dic.aliasing_left(np.full((5, 2), 0.5)) == pytest.approx(2.0)
    assert dic.aliasing_left(np.array([[0.5, 0.0]])) == pytest.approx(1.0)


def test_a_gain_holds_whole_for_small_motions():
    flow = 1e-4 * np.random.default_rng(0).standard_normal((20, 2))
    assert dic.gain_left(flow) == pytest.approx(1.0, abs=1e-6)


@given(MOTIONS)
def test_both_lie_within_their_bounds_and_do_not_hang_on_the_way(flow):
    assert 0.0 <= dic.aliasing_left(flow) <= 2.0 + 1e-9
    assert abs(dic.gain_left(flow)) <= 1.0 + 1e-9
    assert dic.aliasing_left(-flow) == dic.aliasing_left(flow)
    assert dic.gain_left(-flow) == dic.gain_left(flow)


@pytest.mark.parametrize("reading", [dic.aliasing_left, dic.gain_left])
def test_motions_that_are_none_are_refused(reading):
    with pytest.raises(ValueError, match="flow must be"):
        reading(np.ones((3, 3)))
    with pytest.raises(ValueError, match="not finite"):
        reading(np.array([[np.nan, 0.0]]))

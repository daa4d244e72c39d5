"""A narrow shell against the rod that it is: cantilever under end shear and end moment."""

import numpy as np
import pytest

from rig.studies.plates.rod import RING_LENGTH, ring, sheared_rod, sheared_shell


def test_cantilever_under_end_shear_bends_like_the_rod():
    (u, w), (state, end) = sheared_rod(), sheared_shell()
    assert state.stability.converged
    assert (-u, w) == pytest.approx((3.2895436, 6.6998889), rel=1e-7)
    np.testing.assert_allclose(end[[0, 2]], [u, w], rtol=1e-4)  # measured 2e-6
    assert abs(end[1]) < 1e-9


def test_cantilever_under_end_moment_closes_to_a_circle():
    end, moment = ring()
    closed = np.broadcast_to([-RING_LENGTH, 0, 0], end.shape)
    np.testing.assert_allclose(end, closed, atol=1e-3 * RING_LENGTH)
    assert moment == pytest.approx(50 * np.pi / 3, rel=1e-3)

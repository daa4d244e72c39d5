"""Forward models: responses in units of the noise, with exact gradients."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fe
import models
from models.forward import Modal

PLATE = fe.Plate((150.0, 100.0), 1.0, 3000.0, 0.38)
MESH = fe.Mesh(PLATE.size, (24, 16))
GAUGES = np.array([[5.0, 30.0], [75.0, 5.0], [145.0, 80.0], [60.0, 50.0]])
INFLUENCE = fe.influence(PLATE, GAUGES, MESH)
MODES = fe.modes(PLATE, 12, MESH)
SIGMA = np.arange(1.0, 13.0).reshape(4, 3) * 1e-6
FORWARDS = {
    "gauges": models.gauges(INFLUENCE, SIGMA),
    "modal": Modal(MODES, np.random.default_rng(2).normal(0, 50, (12, 12))),
}


@pytest.mark.parametrize("kind", FORWARDS)
@given(x=st.floats(2, 148), y=st.floats(2, 98))
@settings(max_examples=30, deadline=None)
def test_gradient_is_the_derivative_of_the_response(kind, x, y):
    forward, step = FORWARDS[kind], 1e-4
    gradient = forward.gradient(np.array([[x, y]]))[0]
    for axis in (0, 1):
        shift = step * np.eye(2)[[axis]]
        there, back = (forward.response(np.array([[x, y]]) + s * shift)[0] for s in (1, -1))
        slope = (there - back) / (2 * step)
        np.testing.assert_allclose(gradient[:, axis], slope, atol=1e-4 * np.abs(gradient).max())


def test_gauges_respond_with_strain_over_its_noise():
    xy = np.array([[40.0, 60.0], [100.0, 20.0]])
    truth = INFLUENCE.strain(xy) / SIGMA
    np.testing.assert_allclose(FORWARDS["gauges"].response(xy), truth.reshape(2, 12))
    strain = INFLUENCE.strain(xy)[0]
    np.testing.assert_allclose(FORWARDS["gauges"].whiten(strain), truth[0].ravel())


def test_missing_channels_are_no_measurements():
    sigma, missing = SIGMA.copy(), np.zeros((4, 3), dtype=bool)
    sigma[1, 2] = np.inf
    missing[3, 0] = True
    forward = models.gauges(INFLUENCE, sigma, missing)
    there = np.delete(np.arange(12), [5, 9])
    xy = np.array([[40.0, 60.0]])
    whole = FORWARDS["gauges"]
    np.testing.assert_array_equal(forward.response(xy), whole.response(xy)[:, there])
    np.testing.assert_array_equal(forward.gradient(xy), whole.gradient(xy)[:, there])
    strain = np.where(missing, np.nan, 1e-5)
    np.testing.assert_allclose(forward.whiten(strain), (1e-5 / SIGMA).ravel()[there])


@pytest.mark.parametrize("sigma", [2e-6, np.full(4, 2e-6), np.full((4, 3), 2e-6)])
def test_sigma_has_three_forms(sigma):
    np.testing.assert_array_equal(models.gauges(INFLUENCE, sigma).weight, np.full((4, 3), 5e5))


def test_a_sigma_a_gauge_goes_to_its_three_channels():
    weight = models.gauges(INFLUENCE, [1e-6, 2e-6, 4e-6, 8e-6]).weight
    np.testing.assert_allclose(weight, 1e6 / np.array([[1], [2], [4], [8]]) * np.ones(3))


def test_modal_response_is_that_of_the_modes_times_the_factor():
    forward, xy = FORWARDS["modal"], np.array([[40.0, 60.0], [100.0, 20.0]])
    np.testing.assert_allclose(forward.response(xy), MODES.response(xy) @ forward.factor)
    assert forward.response(xy[:0]).shape == (0, 12)
    assert forward.gradient(xy).shape == (2, 12, 2)
    assert forward.plate == FORWARDS["gauges"].plate == PLATE

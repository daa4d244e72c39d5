"""Forward models: responses in units of the noise, with exact gradients."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fe
import models
from models.forward.linear import modal

PLATE = fe.Plate((150.0, 100.0), 1.0, 3000.0, 0.38)
MESH = fe.Mesh(PLATE.size, (24, 16))
RNG = np.random.default_rng(1)
GAUGES = np.array([[5.0, 30.0], [75.0, 5.0], [145.0, 80.0], [60.0, 50.0]])
INFLUENCE = fe.influence(PLATE, GAUGES, MESH)
MODES = fe.modes(PLATE, 12, MESH)
SIGMA = np.arange(1.0, 13.0).reshape(4, 3) * 1e-6
FACTOR = np.random.default_rng(2).normal(0, 50, (12, 9))
COVARIANCE = np.array([a @ a.T for a in np.random.default_rng(3).normal(0, 1e-6, (4, 3, 5))])
FORWARDS = {
    "gauges": models.gauge_forward(INFLUENCE, SIGMA),
    "correlated": models.gauge_forward(INFLUENCE, covariance=COVARIANCE),
    "base free": models.gauge_forward(INFLUENCE, SIGMA).setting_aside(RNG.normal(0, 1, (2, 4, 3))),
    "modal": modal(MODES, FACTOR),
}


@pytest.mark.parametrize("kind", FORWARDS)
@given(x=st.floats(2, 148), y=st.floats(2, 98))
@settings(max_examples=30)
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


def test_missing_channels_say_nothing():
    sigma, missing = SIGMA.copy(), np.zeros((4, 3), dtype=bool)
    sigma[1, 2] = np.inf
    missing[3, 0] = True
    forward = models.gauge_forward(INFLUENCE, sigma, missing)
    there = np.ones(12)
    there[[5, 9]] = 0.0
    xy = np.array([[40.0, 60.0]])
    whole = FORWARDS["gauges"]
    np.testing.assert_array_equal(forward.response(xy), whole.response(xy) * there)
    np.testing.assert_array_equal(forward.gradient(xy), whole.gradient(xy) * there[:, None])
    strain = np.where(missing, np.nan, 1e-5)
    np.testing.assert_allclose(forward.whiten(strain), (1e-5 / SIGMA).ravel() * there)
    assert (whole.freedom, forward.freedom) == (12, 10)


@pytest.mark.parametrize("sigma", [2e-6, np.full(4, 2e-6), np.full((4, 3), 2e-6)])
def test_sigma_has_three_forms(sigma):
    whitened = models.gauge_forward(INFLUENCE, sigma).whiten(np.ones((4, 3)))
    np.testing.assert_array_equal(whitened, np.full(12, 5e5))


def test_a_sigma_a_gauge_goes_to_its_three_channels():
    whitened = models.gauge_forward(INFLUENCE, [1e-6, 2e-6, 4e-6, 8e-6]).whiten(np.ones((4, 3)))
    np.testing.assert_allclose(whitened, 1e6 / np.repeat([1, 2, 4, 8], 3))


def test_correlated_noise_is_made_white():
    whole = np.zeros((12, 12))
    for n, block in enumerate(COVARIANCE):
        whole[3 * n : 3 * n + 3, 3 * n : 3 * n + 3] = block
    strain = RNG.normal(0, 1e-6, (4, 3))
    for covariance in (COVARIANCE, whole):
        forward = models.gauge_forward(INFLUENCE, covariance=covariance)
        white = forward.whiten(strain)
        assert white @ white == pytest.approx(
            strain.ravel() @ np.linalg.solve(whole, strain.ravel())
        )
        response = forward.response(np.array([[40.0, 60.0]]))[0]
        raw = INFLUENCE.strain([[40.0, 60.0]]).ravel()
        assert response @ white == pytest.approx(raw @ np.linalg.solve(whole, strain.ravel()))


def test_a_missing_channel_leaves_those_correlated_with_it_their_own_noise():
    missing = np.zeros((4, 3), dtype=bool)
    missing[2, 1] = True
    strain = RNG.normal(0, 1e-6, (4, 3))
    white = models.gauge_forward(INFLUENCE, missing=missing, covariance=COVARIANCE).whiten(strain)
    truth = 0.0
    for n in range(4):
        there = ~missing[n]
        part = strain[n, there]
        truth += part @ np.linalg.solve(COVARIANCE[n][np.ix_(there, there)], part)
    assert white @ white == pytest.approx(truth)


def test_what_is_set_aside_cannot_be_seen():
    patterns = RNG.normal(0, 1e-5, (2, 4, 3))
    forward = FORWARDS["gauges"].setting_aside(patterns)
    np.testing.assert_allclose(forward.whiten(patterns[0] - 3 * patterns[1]), 0.0, atol=1e-12)
    assert forward.freedom == 10
    columns = (patterns / SIGMA).reshape(2, 12).T
    response = FORWARDS["gauges"].response(np.array([[40.0, 60.0]]))[0]
    left = response - columns @ np.linalg.lstsq(columns, response, rcond=None)[0]
    np.testing.assert_allclose(forward.response(np.array([[40.0, 60.0]]))[0], left)


@pytest.mark.parametrize(
    ("patterns", "sentence"),
    [
        (np.ones((2, 5, 3)), r"must be \(k, 12, 1\) as the measurement, got \(2, 5, 3\)$"),
        (np.ones((2, 4, 3)), "^2 patterns set aside must differ"),
    ],
)
def test_patterns_that_cannot_be_set_aside_are_refused(patterns, sentence):
    with pytest.raises(ValueError, match=sentence):
        FORWARDS["gauges"].setting_aside(patterns)


@pytest.mark.parametrize("kind", FORWARDS)
def test_touches_add_and_their_derivatives_are_exact(kind):
    forward, touches = FORWARDS[kind], np.array([[40.0, 60.0, 2.0], [100.0, 20.0, 0.5]])
    predicted, jacobian = forward.read(touches)
    np.testing.assert_allclose(predicted, touches[:, 2] @ forward.response(touches[:, :2]))
    for k in range(6):
        step = 1e-4 * np.eye(6)[k].reshape(2, 3)
        slope = (forward.read(touches + step)[0] - forward.read(touches - step)[0]) / 2e-4
        np.testing.assert_allclose(jacobian[k], slope, atol=1e-4 * np.abs(jacobian).max())


@pytest.mark.parametrize("kind", ["modal", "whole covariance", "whole covariance, base free"])
def test_what_is_read_often_is_the_same(kind):
    root = np.random.default_rng(4).normal(0, 1e-6, (12, 20))
    whole = models.gauge_forward(INFLUENCE, covariance=root @ root.T)
    free = whole.setting_aside(np.random.default_rng(5).normal(0, 1, (2, 4, 3)))
    forward = {"modal": FORWARDS["modal"], "whole covariance": whole}.get(kind, free)
    often = forward.often()
    touches = np.array([[40.0, 60.0, 2.0], [100.0, 20.0, 0.5]])
    for here, there in zip(often.read(touches), forward.read(touches), strict=True):
        np.testing.assert_allclose(here, there, rtol=1e-9, atol=1e-9 * np.abs(there).max())
    xy = touches[:, :2]
    np.testing.assert_allclose(often.response(xy), forward.response(xy), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(often.gradient(xy), forward.gradient(xy), rtol=1e-9, atol=1e-9)
    measured = np.random.default_rng(6).normal(0, 1, forward.shape)
    np.testing.assert_array_equal(often.whiten(measured), forward.whiten(measured))
    assert often.freedom == forward.freedom
    weight = np.linspace(0.5, 1.0, len(often.whiten(measured)))
    np.testing.assert_array_equal(
        often.weighted(weight).read(touches)[0], forward.weighted(weight).read(touches)[0]
    )


def test_gauges_with_noise_of_their_own_are_read_as_they_stand():
    assert FORWARDS["gauges"].often() is FORWARDS["gauges"]


def test_modal_response_is_that_of_the_modes_times_the_factor():
    forward, xy = FORWARDS["modal"], np.array([[40.0, 60.0], [100.0, 20.0]])
    np.testing.assert_allclose(forward.response(xy), MODES.response(xy) @ FACTOR)
    assert forward.response(xy[:0]).shape == (0, 9)
    assert forward.gradient(xy).shape == (2, 9, 2)
    assert forward.plate == FORWARDS["gauges"].plate == PLATE

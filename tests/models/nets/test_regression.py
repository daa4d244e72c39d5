"""Regressions find what they can hold, and only that."""

import numpy as np
import pytest

from models.data.dataset import Dataset
from models.nets import regression


def made(law, count=60, inputs=4, seed=0):
    """Draw samples of a law from strains to two targets, with an input that never varies."""
    strain = 1e-4 * np.random.default_rng(seed).normal(size=(count, inputs))
    strain[:, 2] = 0.0
    return Dataset(strain, law(strain / 1e-4))


def straight(z):
    return np.column_stack([50.0 + 3.0 * z[:, 0] - z[:, 1], 20.0 + z[:, 3]])


def curved(z):
    return np.column_stack([50.0 + z[:, 0] * z[:, 1], 20.0 + z[:, 3] ** 2 - z[:, 0]])


def error(fit, law):
    fresh = made(law, count=200, seed=1)
    return np.abs(fit(made(law))(fresh.strain) - fresh.targets)


@pytest.mark.parametrize("fit", [regression.linear, regression.ridge, regression.quadratic])
def test_a_straight_law_is_found_by_straight_and_quadratic_fits(fit):
    assert error(fit, straight).max() < 1e-6


def test_a_quadratic_law_is_found_by_a_quadratic_fit_and_not_by_a_straight_one():
    assert error(regression.quadratic, curved).max() < 1e-9
    assert error(regression.linear, curved).mean() > 0.3


def test_a_gaussian_process_comes_close_to_any_smooth_law():
    assert error(regression.gaussian_process, curved).mean() < 0.1
    assert error(regression.gaussian_process, straight).mean() < 0.02


def test_the_nearest_touches_give_back_a_touch_that_was_learnt():
    data = made(curved)
    np.testing.assert_allclose(
        regression.nearest(data)(data.strain), data.targets, rtol=1e-6, atol=1e-6
    )


def test_ridge_shrinks_where_the_targets_are_noise():
    rng = np.random.default_rng(3)
    data = Dataset(rng.normal(size=(30, 25)), rng.normal(size=(30, 2)))
    fresh = rng.normal(size=(100, 25))
    plain, shrunk = (fit(data)(fresh).std() for fit in (regression.linear, regression.ridge))
    assert shrunk < 0.5 * plain

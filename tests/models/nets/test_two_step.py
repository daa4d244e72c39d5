"""The two-step net on a law where a base hides the touch."""

import numpy as np

from models.nets.net import NetOptions
from models.nets.train import Recipe
from models.nets.two_step import DeformableSurface, predict_two_step, train_two_step
from models.scores.score import position_error


def made(count, seed):
    """Draw gauges that add a strong base and a weak touch."""
    rng = np.random.default_rng(seed)
    base = rng.uniform([1.0, -3.0], [4.0, 3.0], (count, 2))
    xy = rng.uniform([10.0, 10.0], [50.0, 30.0], (count, 2))
    places = np.random.default_rng(9).uniform([0.0, 0.0], [60.0, 40.0], (9, 2))
    before = 1e-3 * base @ np.random.default_rng(8).normal(size=(2, 9))
    touch = 1e-4 * np.exp(-((np.linalg.norm(xy[:, None] - places, axis=2) / 30.0) ** 2))
    return DeformableSurface(before, before + touch, base, xy)


def test_it_places_touches_whatever_the_base():
    training, test = made(600, 0), made(100, 1)
    options = NetOptions((16,), "tanh"), NetOptions((32, 32), "tanh")
    recipe = Recipe(600, 1e-2, "cosine", "scaled")
    nets = train_two_step(training, test, options, recipe, np.random.default_rng(0))
    error = position_error(test.xy, predict_two_step(nets, test.before, test.loaded))
    assert error.mean() < 4.0  # measured 2.4 mm; a guess at the middle is off by 12 mm


def test_the_single_net_learns_place_and_base_together():
    surface = made(5, 0)
    np.testing.assert_array_equal(surface.together.targets[:, :2], surface.xy)
    np.testing.assert_array_equal(surface.together.targets[:, 2:], surface.base)
    np.testing.assert_array_equal(surface.together.strain, surface.loaded)

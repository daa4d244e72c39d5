"""What a subset flattens of a bend, against the mean of a parabola."""

import numpy as np
import pytest

from dic.fields.grid import Grid
from dic.fields.roughness import flattening


def grid(step=5, subset=21):
    return Grid(np.arange(20, 220, step), np.arange(15, 165, step), subset, step)


def test_a_parabola_is_off_by_its_mean_over_the_subset():
    g = grid()
    x, y = np.meshgrid(g.xs, g.ys)
    u = 3e-4 * (x - 100.0) ** 2 - 1e-4 * (y - 90.0) ** 2
    arm = np.arange(-10, 11)
    expected = (3e-4 - 1e-4) * np.mean(arm**2)
    found = flattening(u.reshape(1, -1), g, 1)
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert not flattening(u.reshape(1, -1), g, 2).any()


def test_a_plane_and_what_is_lost_add_nothing():
    g = grid()
    x, y = np.meshgrid(g.xs, g.ys)
    plane = (0.01 * x - 0.02 * y).reshape(1, -1)
    plane[0, 7] = np.nan
    found = flattening(plane, g, 1)
    assert np.isfinite(found).all()
    assert np.abs(found).max() <= 1e-12


@pytest.mark.parametrize("step", [5, 10])
def test_noise_alone_is_no_bend(step):
    g = grid(step)
    noise = np.random.default_rng(1).normal(size=(200, len(g.xy)))
    assert flattening(noise, g, 1).std() <= 0.14  # σ of the noise is 1


def test_a_field_smaller_than_its_reach_has_no_bend():
    g = Grid(np.arange(20, 50, 5), np.arange(20, 45, 5), 21, 5)
    assert not flattening(np.ones((2, len(g.xy))), g, 1).any()

"""A loss that falls by a known law is extrapolated, and the range holds it."""

import numpy as np
import pytest

from rig.studies.paper.drawn.extrapolation import fit, forecast, held_out

STEPS = np.geomspace(100, 1e4, 40)


def made(floor, noise, seed=0):
    rng = np.random.default_rng(seed)
    loss = floor + 60.0 * STEPS**-0.4
    return loss * np.exp(noise * rng.normal(size=len(STEPS)))


@pytest.mark.parametrize("floor", [0.0, 0.4])
def test_a_law_without_noise_is_found(floor):
    law = fit(STEPS, made(floor, 0.0), with_floor=floor > 0)
    np.testing.assert_allclose(law.at(np.array([1e6])), floor + 60.0 * 1e6**-0.4, rtol=0.02)


@pytest.mark.slow
def test_the_range_holds_what_is_measured_later():
    rng = np.random.default_rng(1)
    held = [held_out(STEPS, made(0.2, 0.03, seed), 1 / 3, rng) for seed in range(6)]
    assert sum(inside for _, _, inside in held) >= 4
    assert max(abs(error) for _, error, _ in held) < 0.2


def test_the_range_grows_with_the_distance():
    rng = np.random.default_rng(2)
    said = forecast(STEPS, made(0.2, 0.03), np.array([2e4, 1e6]), rng)
    near, far = said.high / said.low
    assert 1.0 < near < far
    assert (said.low <= said.middle).all()
    assert (said.middle <= said.high).all()

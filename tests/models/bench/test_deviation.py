"""How far a bench is from its prior: parts of the plate's stiffness, with exact derivatives."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fe
from models.bench.bench import NAMES, bench_before
from models.bench.deviation import deviation

PLATE = fe.Plate(size=(254.0, 203.0), thickness=1.0, young=2900.0, poisson=0.38)
PRIOR = bench_before(PLATE, young=0.1, sag_xy=0.0)
FREE = PRIOR.sigma > 0
EVERY = np.ones(int(FREE.sum()))
seeds = st.integers(0, 2**32 - 1)


def drawn(seed):
    return PRIOR.sigma * np.random.default_rng(seed).normal(size=len(NAMES))


def test_at_the_prior_it_is_none_and_each_number_stands_for_itself():
    deviations, derivatives = deviation(PRIOR.values, PRIOR, FREE)
    assert not deviations.any()
    np.testing.assert_array_equal(derivatives, np.diag(EVERY))


@given(seeds)
@settings(max_examples=30)
def test_derivatives_are_those_of_differences(seed):
    values, step = drawn(seed), 1e-6
    _, derivatives = deviation(values, PRIOR, FREE)
    for column, index in enumerate(np.flatnonzero(FREE)):
        away = np.zeros(len(NAMES))
        away[index] = step * PRIOR.sigma[index]
        ahead, behind = (deviation(values + sign * away, PRIOR, FREE)[0] for sign in (1, -1))
        np.testing.assert_allclose(
            derivatives[:, column], (ahead - behind) / (2 * step), rtol=1e-6, atol=1e-6
        )


@given(seeds, st.floats(-0.3, 0.3), st.floats(-0.1, 0.1))
@settings(max_examples=30)
def test_clamps_and_tension_count_in_parts_of_the_plate_s_stiffness(seed, young, thickness):
    values = drawn(seed)
    values[[0, 1]] = 0.0
    stiffer = values.copy()
    stiffer[[0, 1]] = young, thickness
    for index, name in enumerate(NAMES):
        if name.startswith("tension"):
            stiffer[index] *= np.exp(young + thickness)
        elif name.startswith("membrane"):
            stiffer[index] *= np.exp(-young - thickness)
        elif name.startswith("rotation"):
            stiffer[index] *= np.exp(-young - 3 * thickness)
    same, changed = (deviation(each, PRIOR, FREE)[0] for each in (values, stiffer))
    np.testing.assert_allclose(changed[2:], same[2:], rtol=1e-10)
    assert changed[0] == pytest.approx(young / 0.1)

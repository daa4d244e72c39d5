"""Steps within limits: against a minimiser of the whole χ²."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import minimize

import fe
import models
from models.bench.limits import HARD, SOFT, ends, limited, pushing

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)


def drawn(seed):
    """Square χ² about a step (5,), and four limits of which some are passed already."""
    rng = np.random.default_rng(seed)
    normal = np.cov(rng.normal(size=(5, 9))) + 0.01 * np.eye(5)
    return rng.normal(size=5), normal, rng.normal(size=(4, 5)), rng.normal(size=4)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_the_step_makes_chi2_smallest(seed):
    free, normal, rows, room = drawn(seed)

    def chi2(step):
        beyond = np.minimum(room + rows @ step, 0.0)
        return (step - free) @ normal @ (step - free) + beyond @ beyond

    found = limited(free, np.linalg.inv(normal), rows, room)
    assert found.cost == pytest.approx(chi2(found.step), rel=1e-6, abs=1e-9)
    assert found.cost <= minimize(chi2, free).fun + 1e-6


def test_a_step_that_passes_no_limit_is_taken():
    step = np.array([1.0, -2.0])
    assert limited(step, np.eye(2), np.eye(2), np.array([0.5, 3.0])).cost == 0.0
    assert np.array_equal(limited(step, np.eye(2), np.empty((0, 2)), np.empty(0)).step, step)


def test_edges_that_may_not_give_have_no_limit():
    described = np.zeros(len(fe.BENCH_PARAMETERS))
    usual = models.bench_before(PLATE)
    sure = models.bench_before(PLATE, rotation_west=0.0, rotation_west_slope=0.0)
    assert [len(ends(prior.values, described, prior, HARD)[0]) for prior in (usual, sure)] == [
        16,
        14,
    ]
    pushed = usual.values - 0.1 * usual.prior * np.array(["membrane" in n for n, _ in models.BENCH])
    assert len(pushing(usual.values, described, usual, SOFT)[0]) == 0
    assert len(pushing(pushed, described, usual, SOFT)[0]) > 0

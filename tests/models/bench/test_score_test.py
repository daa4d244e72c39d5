"""The tail of a weighted sum of squares, against the distributions that it must be."""

import numpy as np
import pytest
from scipy.stats import chi2

from models.bench.score_test import tail


@pytest.mark.parametrize("count", [1, 3, 16])
@pytest.mark.parametrize("sizes", [0.3, 1.0, 3.0, 20.0])
def test_with_equal_weights_it_is_that_of_chi2(count, sizes):
    value = sizes * count
    assert tail(np.full(count, 2.0), 2.0 * value) == pytest.approx(chi2.sf(value, count), rel=0.1)


def test_with_unequal_weights_it_is_what_draws_show():
    weights, rng = np.array([1.0, 0.5, 0.2, 0.01, 0.9]), np.random.default_rng(1)
    drawn = (weights * rng.standard_normal((400_000, 5)) ** 2).sum(axis=1)
    for value in (0.5, 3.0, 8.0):
        assert tail(weights, value) == pytest.approx(np.mean(drawn > value), rel=0.03)


def test_no_fall_is_no_evidence_and_a_huge_one_all():
    assert tail(np.array([1.0, 2.0]), 0.0) == 1.0
    assert tail(np.array([1.0, 1e-15, 2.0]), 1e7) == 0.0

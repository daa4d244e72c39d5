"""How far two touches stand apart, and how sure one is there, in units of what is not known."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from models.inverse.descent_kernel import sort_touches, weak_or_close


def draw(seed, count):
    rng = np.random.default_rng(seed)
    touches = np.column_stack(
        [rng.uniform(5, 140, count), rng.uniform(5, 95, count), rng.uniform(0.2, 4, count)]
    )
    root = rng.normal(size=(3 * count, 3 * count))
    return touches, root @ root.T + 0.1 * np.eye(3 * count)


@settings(max_examples=30)
@given(st.integers(0, 10**6), st.integers(2, 4))
def test_the_distance_of_two_touches_is_in_standard_deviations_of_their_difference(seed, count):
    touches, covariance = draw(seed, count)
    apart = {}
    for j in range(count):
        for i in range(j):
            difference = np.zeros((2, 3 * count))
            difference[[0, 1], [3 * i, 3 * i + 1]] = 1.0
            difference[[0, 1], [3 * j, 3 * j + 1]] = -1.0
            d = difference @ touches.ravel()
            spread = difference @ covariance @ difference.T
            apart[i, j] = d @ np.linalg.solve(spread, d)
    evidence = touches[:, 2] ** 2 / np.diag(covariance)[2::3]
    weakest, found, i, j, squared = weak_or_close(touches, covariance)
    assert (weakest, (i, j)) == (evidence.argmin(), min(apart, key=apart.get))
    assert found == pytest.approx(evidence.min())
    assert squared == pytest.approx(min(apart.values()))


def test_one_touch_is_infinitely_far_from_another():
    touches, covariance = draw(3, 1)
    assert weak_or_close(touches, covariance)[4] == np.inf


@settings(max_examples=30)
@given(st.integers(0, 10**6), st.integers(1, 4))
def test_touches_are_sorted_together_with_their_covariance(seed, count):
    touches, covariance = draw(seed, count)
    touches[:, 0] = np.round(touches[:, 0], -2)  # some of the same x
    order = np.lexsort((touches[:, 1], touches[:, 0]))
    rows = (3 * order[:, None] + np.arange(3)).ravel()
    after, spread = sort_touches(touches, covariance)
    np.testing.assert_array_equal(after, touches[order])
    np.testing.assert_array_equal(spread, covariance[np.ix_(rows, rows)])

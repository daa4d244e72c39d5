"""The covariance of a bench stays one, whatever error its presses share."""

import numpy as np
from hypothesis import given, strategies as st

from models.bench.identify import widened


def drawn(seed, size=6):
    rng = np.random.default_rng(seed)
    root, other = rng.standard_normal((2, size, size))
    return root @ root.T + np.eye(size), other @ other.T


@given(st.integers(0, 1000), st.floats(-1e6, 1e6))
def test_a_covariance_is_positive_whatever_is_taken_off(seed, factor):
    normal, shared = drawn(seed)
    covariance = widened(normal, factor * shared)
    left = np.linalg.eigvalsh(covariance - 0.0999 * np.linalg.inv(normal))
    assert left.min() > -1e-9 * np.abs(covariance).max()


def test_what_is_added_is_that_of_the_slope():
    normal, shared = drawn(1)
    inverse = np.linalg.inv(normal)
    np.testing.assert_allclose(widened(normal, shared), inverse + inverse @ shared @ inverse)

"""The covariance of a bench stays one, whatever error its presses share."""

from dataclasses import replace

import numpy as np
from hypothesis import given, strategies as st

import fe
from models.bench.bench import bench_before
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


def test_a_bench_is_sound_where_its_covariance_is_one():
    bench = bench_before(fe.Plate((254.0, 180.0), 1.0, 3000.0, 0.38))
    assert bench.is_sound
    assert not replace(bench, covariance=-bench.covariance).is_sound
    assert not replace(bench, values=bench.values * np.nan).is_sound

"""Scores of estimates: paired, counted, and honest about how sure they are."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from models.estimate import Estimate, Result
from models.scores.touch_score import pair_touches, score_touches


def reported(touches, sigma=1.0):
    """Return an estimate of touches (k, 3) with equal deviations."""
    touches = np.reshape(touches, (-1, 3)).astype(float)
    spread = sigma**2 * np.eye(touches.size)
    return Estimate(touches[:, :2], touches[:, 2], spread, 0.0, 1, 1.0, Result.FOUND)


def test_touches_are_paired_so_that_distances_are_minimal():
    pairs = pair_touches(
        [reported([[10, 20, 1], [30, 5, 2]])], [np.array([[31.0, 5.0, 2.5], [10.0, 21.0, 1.0]])]
    )
    np.testing.assert_allclose(pairs.error, [[-1, 0, -0.5], [0, -1, 0]])
    np.testing.assert_allclose(pairs.distance, [1.0, 1.0])


def test_misses_and_false_touches_are_counted():
    truth = [np.array([[1.0, 2.0, 1.0], [50.0, 60.0, 2.0]]), np.empty((0, 3)), np.empty((0, 3))]
    nowhere = reported([[5, 5, 1], [70, 9, 2]])
    pairs = pair_touches([reported([[1, 2, 1]]), nowhere, reported([])], truth)
    total, _ = score_touches(pairs)
    assert (total.touches, total.misses, total.false) == (2, 1, 2)
    assert total.max == 0.0


def test_figures_are_those_of_the_distances_alone():
    error = np.array([3.0, 4.0, 5.0, 12.0])
    truth = [np.array([[20.0, 30.0, 2.0]]) for _ in error]
    total, _ = score_touches(pair_touches([reported([[20 + e, 30, 2.5]]) for e in error], truth))
    assert total.mean == 6.0
    assert total.p50 == 4.5
    assert total.max == 12.0
    assert total.rms == pytest.approx(np.sqrt(np.mean(error**2)))
    assert total.force_error == pytest.approx(0.5)


def test_stated_deviations_that_are_right_hold_their_fractions():
    rng = np.random.default_rng(0)
    error = 0.7 * rng.standard_normal((4000, 3))
    truth = np.array([50.0, 60.0, 4.0])
    pairs = pair_touches([reported(truth + e, 0.7) for e in error], [truth[None]] * 4000)
    total, _ = score_touches(pairs, np.full(4000, 2 * 0.7**2))
    np.testing.assert_allclose(total.inside, (0.683, 0.954, 0.997), atol=0.012)
    assert total.rms / total.bound == pytest.approx(1.0, abs=0.03)


def test_bands_divide_the_forces_evenly_in_their_logarithm():
    force = np.geomspace(1.0, 8.0, 31)
    truth = [np.array([[10.0, 10.0, f]]) for f in force]
    total, bands = score_touches(pair_touches([reported(each) for each in truth], truth))
    assert total.force == (1.0, pytest.approx(8.0))
    assert [round(band.force[0], 2) for band in bands] == [1.0, 2.0, 4.0]
    assert sum(band.touches for band in bands) == 31


def test_nothing_found_and_nothing_there_have_no_errors():
    total, bands = score_touches(pair_touches([reported([])], [np.array([[1.0, 1.0, 1.0]])]))
    assert (total.touches, total.misses, total.mean, total.inside) == (1, 1, None, None)
    assert bands == []
    total, bands = score_touches(pair_touches([reported([])], [np.empty((0, 3))]))
    assert (total.touches, total.misses, total.mean, bands) == (0, 0, None, [])


def test_an_estimate_without_its_truth_is_refused():
    with pytest.raises(ValueError, match="every estimate needs its truth, got 1 and 0"):
        pair_touches([reported([])], [])


@given(st.permutations(range(4)), st.integers(0, 2**31))
def test_the_order_in_which_touches_are_reported_does_not_matter(order, seed):
    rng = np.random.default_rng(seed)
    truth, found = rng.uniform(1, 90, (2, 4, 3))
    one, other = (pair_touches([reported(each)], [truth]) for each in (found, found[list(order)]))
    np.testing.assert_allclose(one.distance, other.distance)

"""Scores of predicted places."""

import numpy as np
import pytest

from models.scores.score import matched_error, position_error, score_positions


def test_position_error_is_the_distance_of_each_pair():
    true = np.array([[0.0, 0.0], [1.0, 2.0], [5.0, 5.0]])
    predicted = np.array([[3.0, 4.0], [1.0, 2.0], [5.0, 4.5]])
    np.testing.assert_allclose(position_error(true, predicted), [5.0, 0.0, 0.5])


def test_the_fraction_counts_errors_strictly_below_the_limit():
    figures = score_positions(np.array([0.1, 0.4, 0.5, 1.0]), limit=0.5)
    assert figures.fraction == 0.5
    assert figures.count == 4


def test_mean_quantiles_and_maximum_are_those_of_a_known_distribution():
    error = np.random.default_rng(5).rayleigh(2.0, 200_000)
    figures = score_positions(error)
    assert figures.mean == pytest.approx(2.0 * np.sqrt(np.pi / 2.0), rel=0.01)
    assert figures.p50 == pytest.approx(2.0 * np.sqrt(2.0 * np.log(2.0)), rel=0.01)
    assert figures.p95 == pytest.approx(2.0 * np.sqrt(2.0 * np.log(20.0)), rel=0.01)
    assert figures.max == error.max()


def test_places_that_do_not_pair_and_empty_sets_are_refused():
    with pytest.raises(ValueError, match=r"both be \(N, 2\), got \(3, 2\) and \(2, 2\)"):
        position_error(np.zeros((3, 2)), np.zeros((2, 2)))
    with pytest.raises(ValueError, match="at least 1 touch, got 0"):
        score_positions(np.empty(0))


def test_touches_are_paired_before_they_are_measured():
    true = np.array([[[10.0, 10.0], [50.0, 20.0], [30.0, 80.0]]])
    error, order = matched_error(true, true[:, [2, 0, 1]] + [0.3, 0.4])
    np.testing.assert_allclose(error, 0.5)
    np.testing.assert_array_equal(order, [[1, 2, 0]])


def test_other_numbers_of_touches_cannot_be_paired():
    with pytest.raises(ValueError, match="give x and y of as many touches"):
        matched_error(np.zeros((4, 2, 2)), np.zeros((4, 3, 2)))

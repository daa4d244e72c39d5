"""Touches are matched before they are scored."""

import numpy as np
from hypothesis import given, strategies as st

import fe
import models
from models.scores.matching import pair
from models.scores.touch_score import pair_touches


def estimate(touches):
    touches = np.asarray(touches, dtype=float).reshape(-1, 3)
    n = len(touches)
    result = models.Result.FOUND if n else models.Result.NO_TOUCH
    return models.Estimate(
        touches[:, :2], touches[:, 2], np.eye(3 * n), 0.0, 1, 1.0, result
    )  # fmt: skip


def test_errors_are_distances_and_differences_of_force():
    truth = (fe.Touch(10.0, 20.0, 1.0), fe.Touch(90.0, 40.0, 3.0))
    position, force, true_force = models.match(
        estimate([(93.0, 44.0, 2.5), (10.0, 20.5, 1.2)]), truth
    )
    np.testing.assert_allclose(position, [5.0, 0.5])
    np.testing.assert_allclose(force, [-0.5, 0.2])
    np.testing.assert_allclose(true_force, [3.0, 1.0])


@given(st.permutations(range(4)), st.permutations(range(4)))
def test_order_does_not_matter(of_estimate, of_truth):
    touches = np.array([(10, 20, 1), (90, 40, 3), (50, 60, 2), (30, 70, 4)], dtype=float)
    moved = touches + np.array([1.0, 0.0, 0.1])
    truth = tuple(fe.Touch(*touches[k]) for k in of_truth)
    position, force, _ = models.match(estimate(moved[of_estimate]), truth)
    np.testing.assert_allclose(position, 1.0)
    np.testing.assert_allclose(force, 0.1)


def test_the_whole_distance_is_minimal_rather_than_the_first():
    truth = (fe.Touch(51.0, 20.0, 1.0), fe.Touch(48.0, 20.0, 2.0))
    position, _, true_force = models.match(estimate([(50.0, 20.0, 1.0), (53.0, 20.0, 1.0)]), truth)
    np.testing.assert_array_equal(position, [2.0, 2.0])  # nearest first would give 1 and 5
    np.testing.assert_array_equal(true_force, [2.0, 1.0])


def test_a_false_or_missed_touch_stays_without_partner():
    truth = (fe.Touch(10.0, 20.0, 1.0),)
    position, _, _ = models.match(estimate([(80.0, 80.0, 1.0), (10.0, 21.0, 1.0)]), truth)
    np.testing.assert_allclose(position, [1.0])
    assert len(models.match(estimate([]), truth)[0]) == 0
    assert len(models.match(estimate([(1.0, 1.0, 1.0)]), ())[0]) == 0


def test_a_pair_is_two_indices():
    reported, true = pair(
        np.array([(90.0, 41.0), (10.0, 20.0), (50.0, 5.0)]), np.array([(12.0, 20.0)])
    )
    np.testing.assert_array_equal(reported, [1])
    np.testing.assert_array_equal(true, [0])
    assert [len(each) for each in pair(np.empty((0, 2)), np.ones((3, 2)))] == [0, 0]


@given(st.integers(0, 4), st.integers(0, 4), st.integers(0, 100))
def test_frames_and_sets_of_touches_are_paired_alike(found, there, seed):
    rng = np.random.default_rng(seed)
    reported, true = (rng.uniform(1.0, 90.0, (count, 3)) for count in (found, there))
    position, force, _ = models.match(estimate(reported), tuple(fe.Touch(*each) for each in true))
    pairs = pair_touches([estimate(reported)], [true])
    seen = np.isfinite(pairs.distance)
    np.testing.assert_allclose(np.sort(position), np.sort(pairs.distance[seen]))
    np.testing.assert_allclose(np.sort(force), np.sort(pairs.error[seen, 2]))

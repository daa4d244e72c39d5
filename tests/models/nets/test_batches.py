"""Batches: all of a set, sums of touches, noise."""

from itertools import islice

import numpy as np
import pytest

from models.data.dataset import Dataset, flatten_samples
from models.nets.batches import (
    estimated,
    gain,
    mixed_batches,
    noisy_batches,
    shuffled_batches,
    superposed_batches,
)

SINGLE = Dataset(np.diag(np.arange(1.0, 9.0)), np.arange(16.0).reshape(8, 2)[::-1])


def test_a_round_of_batches_holds_every_sample_once():
    rounds = list(islice(shuffled_batches(SINGLE, 4, np.random.default_rng(0)), 4))
    for first, second in (rounds[:2], rounds[2:]):
        rows = np.concatenate([first.targets, second.targets])
        np.testing.assert_array_equal(np.sort(rows, axis=0), np.sort(SINGLE.targets, axis=0))
    assert not np.array_equal(rounds[0].targets, rounds[2].targets)


def test_pressed_together_strains_add_and_places_are_sorted():
    batch = next(superposed_batches(SINGLE, 3, 50, np.random.default_rng(0)))
    places = batch.targets.reshape(50, 3, 2)
    assert np.all(np.diff(places[..., 0], axis=1) >= 0.0)
    rows = (14.0 - places[..., 0]) / 2.0
    expected = SINGLE.strain[rows.astype(int)].sum(axis=1)
    np.testing.assert_array_equal(batch.strain, expected)


def test_magnitudes_are_drawn_and_reported_after_the_places():
    batch = next(superposed_batches(SINGLE, 2, 500, np.random.default_rng(0), largest=4.0))
    places, magnitudes = batch.targets[:, :4].reshape(-1, 2, 2), batch.targets[:, 4:]
    assert magnitudes.min() >= 1.0
    assert 3.9 < magnitudes.max() <= 4.0
    rows = ((14.0 - places[..., 0]) / 2.0).astype(int)
    expected = np.einsum("nk,nki->ni", magnitudes, SINGLE.strain[rows])
    np.testing.assert_allclose(batch.strain, expected)


def test_noise_has_its_deviation_and_leaves_the_targets():
    calm = Dataset(np.zeros((2000, 4), np.float32), np.ones((2000, 2)))
    batch = next(noisy_batches(iter([calm]), 3e-6, np.random.default_rng(0)))
    assert batch.strain.std() == pytest.approx(3e-6, rel=0.05)
    assert batch.strain.mean() == pytest.approx(0.0, abs=2e-7)
    np.testing.assert_array_equal(batch.targets, calm.targets)


def test_noise_that_channels_have_in_common_has_its_covariance():
    calm = Dataset(np.zeros((20000, 2), np.float32), np.ones((20000, 2)))
    covariance = np.array([[4.0, 1.2], [1.2, 1.0]])
    root = np.linalg.cholesky(covariance)
    batch = next(noisy_batches(iter([calm]), root, np.random.default_rng(0)))
    np.testing.assert_allclose(np.cov(batch.strain.T), covariance, atol=0.1)


def test_touches_are_reported_as_regression_would_estimate_them_from_the_noise():
    rng = np.random.default_rng(0)
    slope, places = rng.normal(size=(2, 6)), rng.uniform(0.0, 40.0, (50, 2))
    moves = gain(np.broadcast_to(slope.T.reshape(2, 3, 2), (50, 2, 3, 2)))
    single = Dataset(places @ slope, places)  # linear: what holds to first order is exact
    batch = next(estimated(single, moves, (1e-3, 1e-1), 4000, rng))
    expected = np.linalg.lstsq(slope.T, batch.strain.T, rcond=None)[0].T
    np.testing.assert_allclose(batch.targets, expected, atol=1e-10)
    left = np.linalg.norm(batch.strain - expected @ slope, axis=1) / 2.0  # in four directions
    assert np.percentile(left, 1) < 2e-3
    assert np.percentile(left, 99) > 5e-2


def test_targets_of_several_touches_are_places_and_magnitudes_if_asked():
    touches = np.array([[[1.0, 2.0, 0.5], [3.0, 4.0, 2.0]]])
    np.testing.assert_array_equal(
        flatten_samples(np.zeros((1, 5, 3)), touches).targets, [[1, 2, 3, 4]]
    )
    with_force = flatten_samples(np.zeros((1, 5, 3)), touches, unit=0.5)
    np.testing.assert_array_equal(with_force.targets, [[1, 2, 3, 4, 1, 4]])
    assert with_force.strain.shape == (1, 15)


def test_two_kinds_of_batches_are_joined_row_by_row():
    one, other = (
        iter([Dataset(np.full((rows, 3), value), np.full((rows, 2), value))] * 2)
        for rows, value in ((4, 1.0), (2, 5.0))
    )
    joined = list(mixed_batches(one, other))
    assert [len(each) for each in joined] == [6, 6]
    np.testing.assert_array_equal(joined[0].targets[:, 0], [1, 1, 1, 1, 5, 5])
    np.testing.assert_array_equal(joined[0].strain[:, 0], joined[0].targets[:, 0])

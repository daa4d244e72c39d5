"""What presses show of their labels: how far they err, and which lie far beyond the others."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from models.bench.labels import Shown, common_offset, label_errors

STATED = np.array([0.3, 0.3, 0.02])


def shown(errors, spread=1e-3):
    """Presses that measure their touch well, and labels that err by `errors` (N, 3)."""
    small = np.full(errors.shape, spread)
    return Shown(-errors, small, -errors, np.diag(small.ravel() ** 2))


def errors_of(stated, seen, taken=1.0):
    """Errors of labels, of which the touches were found with σ of `taken` times those stated."""
    return label_errors(stated, taken * stated, seen)


def drawn(scale, count, seed=1):
    return np.random.default_rng(seed).standard_normal((count, 3)) * STATED * scale


@pytest.mark.parametrize("scale", [0.3, 1.0, 3.0])
def test_many_labels_show_how_far_they_err(scale):
    found = errors_of(np.tile(STATED, (400, 1)), shown(drawn(scale, 400)))
    assert np.allclose(found.sigmas, scale * STATED, rtol=0.15)


@pytest.mark.parametrize("scale", [0.15, 0.5, 1.0, 2.0])
def test_of_a_few_labels_sigma_is_right_on_average(scale):
    found = [
        errors_of(np.tile(STATED, (9, 1)), shown(drawn(scale, 9, seed))).sigmas[0, 2] / STATED[2]
        for seed in range(40)
    ]
    assert np.exp(np.mean(np.log(found))) == pytest.approx(scale, rel=0.15)
    assert np.std(np.log(found)) < 0.35  # nine numbers alone: 0.24


def test_a_label_that_nothing_else_shows_errs_by_what_is_stated():
    alone = Shown(np.zeros((1, 3)), np.full((1, 3), 10.0), np.zeros((1, 3)), np.diag(STATED**2))
    found = errors_of(STATED[None], alone)
    np.testing.assert_allclose(found.sigmas, STATED[None])


def shown_and_taken(errors, taken, spread=1e-3):
    """Presses that measure their touch well; touches that are found from these and the labels."""
    sigmas = np.tile(taken * STATED, (len(errors), 1))
    variance = 1.0 / (spread**-2 + sigmas**-2)
    covariance = np.diag(variance.ravel())
    return Shown(-errors, np.full(errors.shape, spread), -errors * variance / spread**2, covariance)


@pytest.mark.parametrize("taken", [0.2, 4.0])
def test_what_labels_show_does_not_depend_on_what_they_were_taken_for(taken):
    """Touches are found from presses and labels: the part of the labels is taken out again."""
    errors, stated = drawn(0.5, 9), np.tile(STATED, (9, 1))
    found, usual = (
        errors_of(stated, shown_and_taken(errors, so), so).sigmas for so in (taken, 1.0)
    )
    np.testing.assert_allclose(found, usual, rtol=1e-6)


def test_a_label_far_off_is_believed_the_less_and_the_others_as_before():
    errors = drawn(1.0, 20)
    errors[7, 0] = 30.0  # mm
    found = errors_of(np.tile(STATED, (20, 1)), shown(errors))
    assert np.flatnonzero(found.outliers).tolist() == [7]
    assert found.sigmas[7, 0] > 30.0
    others = np.delete(np.arange(20), 7)
    assert (found.sigmas[others] < 1.5 * STATED).all()
    assert found.sigmas[7, 2] < 1.5 * STATED[2], "its force may be right"


@given(st.lists(st.booleans(), min_size=3, max_size=12), st.integers(0, 1000))
def test_what_is_unknown_stays_unknown(known, seed):
    stated = np.where(np.array(known)[:, None], STATED, np.inf)
    found = errors_of(stated, shown(drawn(1.0, len(known), seed)))
    np.testing.assert_array_equal(np.isfinite(found.sigmas), np.isfinite(stated))
    assert not found.outliers[~np.array(known)].any()


def test_places_that_all_lie_to_one_side_are_reported_and_those_that_scatter_are_not():
    errors, sure = drawn(1.0, 16), np.array([0.05, 0.05])
    sigmas = np.tile(STATED, (16, 1))
    assert not common_offset(sigmas, shown(errors), sure).any()
    offset = common_offset(sigmas, shown(errors + np.array([0.0, 0.8, 0.0])), sure)
    assert offset[0] == 0.0
    assert offset[1] == pytest.approx(0.8, abs=0.2)


def test_labels_that_are_not_known_lie_nowhere():
    sigmas = np.full((5, 3), np.inf)
    assert not common_offset(sigmas, shown(drawn(1.0, 5)), np.full(2, 0.05)).any()

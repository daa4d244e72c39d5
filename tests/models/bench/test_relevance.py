"""Numbers whose causes have unknown scales: exact where one cause is, honest where several are."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp

from models.bench.bench import NAMES
from models.bench.relevance import (
    SCALES,
    Information,
    causes_among,
    likely_scales,
    over_scales,
    posterior,
)

CAUSES = [np.arange(0, 4), np.arange(4, 6), np.arange(6, 12)]
SIZE = 14  # the last two belong to no cause


def whole(information, causes):
    scales = likely_scales(information, causes)
    return over_scales(information, causes, scales, np.eye(len(scales)))


def measured(rng, truth, rows=20):
    seen = rng.normal(size=(rows, len(truth))) * np.geomspace(3.0, 0.1, len(truth))
    return Information(seen.T @ seen, seen.T @ (seen @ truth + rng.normal(size=rows)))


def test_each_cause_has_numbers_of_its_own_and_what_was_measured_has_none():
    causes = causes_among(np.ones(len(NAMES), dtype=bool))
    numbers = np.concatenate(causes)
    assert len(set(numbers)) == len(numbers)
    without = {NAMES[k] for k in set(range(len(NAMES))) - set(numbers)}
    assert without == {"young", "thickness"}
    free = np.isin(NAMES, ("young", "sag", "sag_x", "k1"))
    assert [len(each) for each in causes_among(free)] == [2, 1]


def test_without_a_measurement_all_is_as_uncertain_as_stated():
    found = whole(Information(np.zeros((SIZE, SIZE)), np.zeros(SIZE)), CAUSES)
    np.testing.assert_allclose(found.mean, 0.0, atol=1e-12)
    np.testing.assert_allclose(found.covariance, np.eye(SIZE), atol=0.03)


def test_one_cause_has_the_moments_of_its_mixture():
    rng = np.random.default_rng(1)
    information = measured(rng, 0.2 * rng.normal(size=SIZE))
    mean, covariance = enumerated(information, CAUSES[:1])
    found = whole(information, CAUSES[:1])
    np.testing.assert_allclose(found.mean, mean, atol=1e-9)
    np.testing.assert_allclose(found.covariance, covariance, atol=1e-9)


def test_several_causes_have_nearly_the_moments_of_all_their_scales():
    """All 125 combinations, enumerated: what each cause changes is taken with the others fixed."""
    rng, off, wide = np.random.default_rng(7), [], []
    for _ in range(12):
        information = measured(rng, drawn(rng))
        mean, covariance = enumerated(information, CAUSES)
        found = whole(information, CAUSES)
        sigma = np.sqrt(np.diag(covariance))
        off.append(np.abs(found.mean - mean) / sigma)
        wide.append(np.sqrt(np.diag(found.covariance)) / sigma)
    assert np.mean(off) < 0.1
    assert np.max(off) < 1.0
    assert np.mean(wide) == pytest.approx(1.0, abs=0.1)
    assert 0.5 < np.min(wide) <= np.max(wide) < 1.6


def drawn(rng):
    """Numbers of which each cause has a scale of its own."""
    truth = rng.normal(size=SIZE)
    for numbers in CAUSES:
        truth[numbers] *= rng.choice(SCALES)
    return truth


def enumerated(information, causes):
    """Mean and covariance over all combinations of scales, equally likely before."""
    means, covariances, evidence = [], [], []
    for chosen in product(SCALES, repeat=len(causes)):
        scales = np.ones(SIZE)
        for numbers, scale in zip(causes, chosen, strict=True):
            scales[numbers] = scale
        part = posterior(information, scales)
        inner = np.eye(SIZE) + scales[:, None] * information.matrix * scales
        likely = information.towards @ part.mean - np.linalg.slogdet(inner)[1]
        means.append(part.mean)
        covariances.append(part.covariance)
        evidence.append(0.5 * likely)
    weights = np.exp(evidence - np.max(evidence))
    weights /= weights.sum()
    mean = weights @ np.array(means)
    away = np.array(means) - mean
    covariance = np.tensordot(weights, covariances, 1) + (weights[:, None] * away).T @ away
    return mean, covariance


def test_absent_causes_make_the_others_better_known_and_sigma_says_so():
    rng, within, better = np.random.default_rng(2), [], []
    for _ in range(300):
        truth = drawn(rng)
        information = measured(rng, truth)
        found, stated = whole(information, CAUSES), posterior(information, np.ones(SIZE))
        within.append((found.mean - truth) / np.sqrt(np.diag(found.covariance)))
        better.append([np.square(each.mean - truth).mean() for each in (found, stated)])
    inside = np.abs(within)
    assert 0.64 < np.mean(inside < 1.0) < 0.78
    assert 0.93 < np.mean(inside < 2.0) < 0.98
    found, stated = np.median(better, axis=0)
    assert found < 0.75 * stated


def test_what_is_wanted_of_the_numbers_has_their_moments():
    rng = np.random.default_rng(3)
    information = measured(rng, rng.normal(size=SIZE))
    scales, onto = likely_scales(information, CAUSES), rng.normal(size=(3, SIZE))
    all_of_it = over_scales(information, CAUSES, scales, np.eye(SIZE))
    wanted = over_scales(information, CAUSES, scales, onto)
    np.testing.assert_allclose(wanted.mean, onto @ all_of_it.mean, rtol=1e-9)
    np.testing.assert_allclose(
        wanted.covariance, onto @ all_of_it.covariance @ onto.T, rtol=1e-7, atol=1e-12
    )


@settings(max_examples=60)
@given(
    hnp.arrays(np.float64, (6, SIZE), elements=st.floats(-30.0, 30.0)),
    hnp.arrays(np.float64, 6, elements=st.floats(-30.0, 30.0)),
)
def test_a_covariance_is_one_whatever_is_measured(seen, values):
    found = whole(Information(seen.T @ seen, seen.T @ values), CAUSES)
    assert np.isfinite(found.mean).all()
    smallest = np.linalg.eigvalsh(found.covariance)[0]
    assert smallest > -1e-9


def test_a_cause_that_is_far_beyond_its_prior_is_not_drawn_to_it():
    truth = np.zeros(SIZE)
    truth[:4] = (6.0, -5.0, 4.0, 7.0)
    information = measured(np.random.default_rng(4), truth)
    assert likely_scales(information, CAUSES)[0] == pytest.approx(SCALES[-1], rel=0.05)

"""Touches on an unknown bench: what a frame shows to be absent counts for little."""

from dataclasses import replace

import numpy as np
import pytest

import fe
import models

PLATE = fe.Plate((150.0, 100.0), 1.0, 3000.0, 0.38)
NAMES = [name for name, _ in models.BENCH]
NOISE = 2e-3  # of an amplitude, mm²


@pytest.fixture(scope="module")
def forward(modal_bench):
    return modal_bench(PLATE, NOISE)


def frames(forward, **numbers):
    """Yield touches and what a frame shows of them, on a bench with some numbers."""
    values, rng = np.zeros(len(NAMES)), np.random.default_rng(6)
    for name, value in numbers.items():
        values[NAMES.index(name)] = value
    for _ in range(24):
        touch = np.array([rng.uniform(25, 125), rng.uniform(25, 75), rng.uniform(1.0, 3.0)])
        shown = forward.on(values, None).read(touch[None])[0]
        yield touch, shown + rng.standard_normal(len(shown))


def errors(estimator, seen):
    off, sigma = np.empty((len(seen), 3)), np.empty((len(seen), 3))
    for k, (touch, shown) in enumerate(seen):
        found = estimator.by_relevance(estimator.fit_whitened(shown, touch[None], count=1), shown)
        off[k] = np.append(found.xy[0], found.force[0]) - touch
        sigma[k] = np.sqrt(np.diag(found.covariance))
    return off, sigma


@pytest.mark.parametrize("numbers", [{}, {"sag": 0.1}, {"tension_xx": 0.1, "tension_yy": 0.06}])
def test_places_are_better_known_where_one_thing_is_wrong(forward, numbers):
    prior, seen = models.bench_before(PLATE), list(frames(forward, **numbers))
    whole = replace(prior, covariance=1.01 * prior.covariance)  # as presses have left it
    off, sigma = errors(models.Estimator(forward, bench=prior, max_touches=1), seen)
    before, stated = errors(models.Estimator(forward, bench=whole, max_touches=1), seen)
    assert (np.median(sigma, axis=0)[:2] < 0.6 * np.median(stated, axis=0)[:2]).all()
    assert np.mean(np.abs(off / sigma) < 2.0) > 0.85
    if not numbers:
        places, all_wrong = (np.median(np.hypot(*each[:, :2].T)) for each in (off, before))
        assert places < 0.5 * all_wrong


@pytest.mark.slow
def test_noise_scatters_by_half_more_than_stated_as_scales_are_inferred_anew(forward):
    """docs/limits.md says so; the whole covariance holds it."""
    prior, rng = models.bench_before(PLATE), np.random.default_rng(11)
    estimator, scattered = models.Estimator(forward, bench=prior, max_touches=1), []
    for _ in range(8):
        touch, values = np.array([[62.0, 48.0, 2.0]]), np.zeros(len(NAMES))
        plate = len(fe.BENCH_PARAMETERS)
        values[:plate] = np.abs(rng.normal(0.0, 0.5 * prior.prior[:plate]))
        shown, seen = forward.on(values, None).read(touch)[0], []
        for _ in range(16):
            noisy = shown + rng.standard_normal(len(shown))
            found = estimator.fit_whitened(noisy, touch, count=1)
            seen.append(estimator.by_relevance(found, noisy))
        off = np.array([np.append(one.xy[0], one.force[0]) for one in seen])
        noise = np.mean([one.covariance - one.systematic for one in seen], axis=0)
        off -= off.mean(axis=0)
        scattered.append(np.mean(np.einsum("ni,ni->n", off @ np.linalg.inv(noise), off)) / 3)
        whole = np.mean([np.diag(one.covariance) for one in seen], axis=0)
        assert (off.var(axis=0) < whole).all()
    assert 1.0 < np.mean(scattered) < 3.0


def test_the_fit_is_judged_by_the_whole_prior(forward):
    estimator = models.Estimator(forward, bench=models.bench_before(PLATE), max_touches=1)
    for touch, shown in frames(forward, sag=0.1):
        stated = estimator.fit_whitened(shown, touch[None])
        found = estimator.by_relevance(stated, shown)
        assert (found.count, found.chi2, found.p_value) == (1, stated.chi2, stated.p_value)
        assert np.linalg.eigvalsh(found.systematic).min() > 0.0
        assert found.covariance[0, 0] < stated.covariance[0, 0]


def test_a_force_with_an_interval_is_left_as_it_is(forward):
    """χ² is no parabola there, as the step to another bench would have it."""
    estimator = models.Estimator(forward, bench=models.bench_before(PLATE), max_touches=1)
    touch = np.array([[12.0, 50.0, 2.0]])
    shown = forward.read(touch)[0]
    found = estimator.with_force_intervals(estimator.fit_whitened(shown, touch, count=1), shown)
    assert found.force_intervals[0] is not None
    assert estimator.by_relevance(found, shown) is found


def test_a_bench_that_presses_have_shown_is_left_as_it_is(forward):
    prior = models.bench_before(PLATE)
    known = replace(prior, covariance=0.3 * prior.covariance)
    touch, shown = next(frames(forward))
    for estimator in (models.Estimator(forward, bench=known), models.Estimator(forward)):
        found = estimator.fit_whitened(shown, touch[None])
        assert estimator.by_relevance(found, shown) is found


def test_what_is_known_of_a_touch_is_known_still(forward):
    """A prior of its force, which no bench can take away."""
    prior, (touch, shown) = models.bench_before(PLATE), next(frames(forward, young=-0.15))
    known = models.prior(force=float(touch[2]), force_sigma=0.01)
    estimator = models.Estimator(forward, bench=prior, max_touches=1, prior=known)
    found = estimator.by_relevance(estimator.fit_whitened(shown, touch[None], count=1), shown)
    assert found.force[0] == pytest.approx(touch[2], abs=0.03)
    assert found.covariance[2, 2] <= 0.0101**2

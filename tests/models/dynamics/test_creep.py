"""Creep: against the closed form of a step, and learned from a relaxing solid."""

import numpy as np
import pytest

import models
from models import Creep


def test_a_step_of_force_creeps_as_its_prony_terms_say():
    creep, elastic = Creep((0.02, 0.05), (5.0, 60.0)), np.array([2.0, -1.0])
    crept = creep.rest(2)
    for step in (0.1, 3.0, 0.0, 20.0, 6.9):
        crept = creep.after(crept, elastic, step)
    terms = np.array([0.02, 0.05]) * (1 - np.exp(-30.0 / np.array([5.0, 60.0])))
    np.testing.assert_allclose(crept, np.outer(terms, elastic), rtol=1e-12)
    np.testing.assert_allclose(
        creep.after(crept, 0 * elastic, 60.0).sum(axis=0),
        (terms * np.exp(-60.0 / np.array([5.0, 60.0]))).sum() * elastic,
    )


def relaxing(times, force):
    """Deflection of a Maxwell solid of three branches under a force, N of an elastic plate."""
    parts, taus = np.array([0.012, 0.022, 0.034]), np.array([2.0, 15.0, 90.0])
    strain, flown = np.zeros(len(times)), np.zeros(3)
    for k, time in enumerate(times):
        fade = np.exp(-(time - times[k - 1]) / taus) if k else np.ones(3)
        lasting = 1 - parts.sum() + parts @ fade
        strain[k] = (force[k] + parts @ (fade * flown)) / lasting
        flown = fade * flown + (1 - fade) * strain[k]
    return strain


def test_a_press_of_unknown_force_teaches_the_creep_of_another():
    rng, times, sigma = np.random.default_rng(1), np.arange(0.0, 121.0, 0.1), 0.004
    wandering = 1.5 + 0.3 * np.sin(times / 7.0)
    pressed = (times > 1.0) & (times < 61.0)
    shown = relaxing(times, np.where(pressed, wandering, 0.0)) + rng.normal(0, sigma, len(times))
    learned = models.learn_creep(times, shown, 61.0, sigma)
    assert learned.scatter < 1.1 * sigma
    other = np.where(pressed, 2.0, 0.0)
    shown = relaxing(times, other)
    force = shown - models.crept_force(learned.creep, times, shown, 61.0)
    assert np.abs(shown[pressed] / 2.0 - 1).max() > 0.05
    assert np.abs(force[pressed] / 2.0 - 1).max() < 0.01
    assert np.abs(force[times > 61.2]).max() < 0.01


def test_no_term_is_learned_that_readings_are_too_rare_to_show():
    rng, times, sigma = np.random.default_rng(0), np.arange(0.0, 100.0, 0.5), 0.05
    pressed = (times > 2.0) & (times < 50.0)
    for _ in range(5):
        shown = relaxing(times, np.where(pressed, 4.0, 0.0)) + rng.normal(0, sigma, len(times))
        learned = models.learn_creep(times, shown, 50.5, sigma)
        assert min(learned.creep.times) > 1.99  # four readings


def test_a_plate_that_does_not_creep_is_refused():
    times, rng = np.arange(0.0, 60.0, 0.1), np.random.default_rng(0)
    shown = np.where(times < 30.0, 2.0, 0.0) + rng.normal(0, 0.01, len(times))
    with pytest.raises(ValueError, match="no more than noise"):
        models.learn_creep(times, shown, 30.0, 0.01)
    with pytest.raises(ValueError, match="20 readings"):
        models.learn_creep(times, shown, 59.0, 0.01)
    with pytest.raises(ValueError, match="2 readings before the release, got 1"):
        models.learn_creep(times, shown, 0.05, 0.01)


@pytest.mark.parametrize(
    ("parts", "times"),
    [((0.1,), (1.0, 2.0)), ((-0.1,), (1.0,)), ((0.1,), (0.0,)), ((1.0,), (1.0,))],
)
def test_terms_that_no_material_has_are_refused(parts, times):
    with pytest.raises(ValueError, match="creep"):
        Creep(parts, times)

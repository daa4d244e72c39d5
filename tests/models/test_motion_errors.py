"""Errors of the motion of tiles in touches: the bench stays, pixels and aliasing are their own."""

from dataclasses import replace

import numpy as np
import pytest

import models


def estimate(systematic):
    return models.Estimate(
        np.zeros((1, 2)), np.ones(1), np.diag([4.0, 4.0, 2.0]), 1.0, 1, 0.5, models.Result.FOUND,
        systematic=systematic,
    )  # fmt: skip


@pytest.mark.parametrize("bench", [0.0, 1.0])
def test_pixels_and_aliasing_take_the_place_of_the_noise_of_any_motion(bench):
    known = bench * np.eye(3)
    given = estimate(known if bench else None)
    noise = given.covariance - known
    found = models.with_motion_errors(given, models.MotionErrors(pixels=0.6, aliased=0.1))
    np.testing.assert_allclose(found.covariance, known + 0.7 * noise)
    np.testing.assert_allclose(found.systematic, known + 0.1 * noise)


def test_a_gain_makes_all_forces_too_large_at_once():
    given = models.Estimate(
        np.zeros((2, 2)), np.array([1.0, 3.0]), np.eye(6), 1.0, 1, 0.5, models.Result.FOUND
    )
    found = models.with_motion_errors(given, models.MotionErrors(0.5, 0.0, gain=0.1))
    assert np.diag(found.systematic) == pytest.approx([0, 0, 0.01, 0, 0, 0.09])
    assert found.systematic[2, 5] == pytest.approx(0.03)
    np.testing.assert_allclose(found.covariance, found.systematic + 0.5 * np.eye(6))


def test_without_aliasing_nothing_changes():
    given = estimate(None)
    assert models.with_motion_errors(given, models.OF_PIXELS) is given
    nothing = replace(given, xy=np.empty((0, 2)), force=np.empty(0), covariance=np.empty((0, 0)))
    assert models.with_motion_errors(nothing, models.MotionErrors(0.5, 0.1)) is nothing


def test_what_cannot_be_known_stays_unknown():
    given = replace(estimate(None), covariance=np.full((3, 3), np.inf))
    assert models.with_motion_errors(given, models.MotionErrors(0.5, 0.0)) is given

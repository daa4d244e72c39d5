"""A touch that is not certain is reported by the second frame that shows it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import fe
import models
from rig.live.confirmation import confirmed
from rig.live.frame_estimate import FrameEstimate

PLATE = fe.Plate((120.0, 80.0), 1.0, 3000.0, 0.35)
GAUGES = np.array([[x, y] for x in (15.0, 60.0, 105.0) for y in (15.0, 40.0, 65.0)])
SIGMA = 1e-6
FORWARD = models.gauge_forward(fe.influence(PLATE, GAUGES), SIGMA)
ESTIMATOR = models.Estimator(FORWARD)
CHAIN = SimpleNamespace(masked_models=SimpleNamespace(for_frame=lambda *seen: (None, ESTIMATOR)))
NONE = np.empty((0, 3))


def times_its_noise(times):
    """Make a touch (1, 3) so strong that its force is so many standard deviations."""
    unit = np.array([[70.0, 45.0, 1.0]])
    for _ in range(5):
        sigma = np.sqrt(ESTIMATOR.fit_whitened(FORWARD.read(unit)[0]).covariance[2, 2])
        unit[0, 2] = times * sigma
    return unit


def frame(touches):
    """Take what a frame without noise says of touches (n, 3), begun from none."""
    measured = FORWARD.read(touches)[0]
    estimate = ESTIMATOR.fit_whitened(measured)
    state = state_of(np.column_stack([estimate.xy, estimate.force]))
    return FrameEstimate(estimate, None, np.zeros(9, bool), 0.0, "", state, measured=measured)


def state_of(touches):
    memory = SimpleNamespace(left=models.NO_TRACES)
    return SimpleNamespace(touches=touches, memory=memory)


@pytest.fixture(scope="module")
def weak():
    return frame(times_its_noise(5.5))


def test_an_uncertain_touch_waits_for_a_second_frame(weak):
    assert weak.estimate.result is models.Result.UNRESOLVABLE
    assert weak.estimate.count == 1
    first = confirmed(CHAIN, weak, state_of(NONE))
    assert first.estimate.count == 0
    assert first.estimate.result is models.Result.NO_TOUCH
    assert first.state is weak.state
    assert confirmed(CHAIN, weak, first.state) is weak


def test_a_certain_touch_is_reported_at_once():
    clear = frame(times_its_noise(8.0))
    assert clear.estimate.result is models.Result.FOUND
    assert confirmed(CHAIN, clear, state_of(NONE)) is clear


def test_beside_a_touch_that_is_held_only_the_new_one_waits():
    both = np.vstack([[30.0, 25.0, 1.0], times_its_noise(5.5)[0]])
    found = frame(both)
    assert (found.estimate.count, found.estimate.result) == (2, models.Result.UNRESOLVABLE)
    first = confirmed(CHAIN, found, state_of(both[:1]))
    np.testing.assert_allclose(first.estimate.xy, both[:1, :2], atol=0.5)


def test_what_a_finger_may_have_left_far_from_where_it_pressed_waits(weak):
    """It moved on and lifted while no frame was taken; a touch as strong as it was may be one."""
    force = weak.state.touches[0, 2]
    strong, alike = (np.array([[15.0, 15.0, times * force]]) for times in (100.0, 2.0))
    assert confirmed(CHAIN, weak, state_of(strong)).estimate.count == 0
    assert confirmed(CHAIN, weak, state_of(alike)) is weak
    near = weak.state.touches + np.array([6.0, 0.0, 99.0 * force])
    assert confirmed(CHAIN, weak, state_of(near)) is weak


def test_a_frame_of_which_nothing_is_kept_stands(weak):
    bare = replace(weak, measured=None)
    assert confirmed(CHAIN, bare, state_of(NONE)) is bare

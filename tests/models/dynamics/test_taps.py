"""Taps on a plate that rings: its deflection is that of many modes, integrated in small steps."""

from dataclasses import replace

import numpy as np
import pytest

import fe
import models
from models import Estimator, InTime, RingingPlate, Seeing
from models.dynamics.follow import Followed, averaged
from models.dynamics.vibration import at_rest
from models.forward.linear import modal

PLATE = fe.Plate((254.0, 180.0), 1.5, 3000.0, 0.38, fe.Clamped())
DENSITY, DAMPING, EXPOSURE = 1400.0, 0.02, 0.006
STEP = 1e-4  # s
TRUE, KNOWN = 180, 130  # modes of the truth, and of the estimator


class Bench:
    """A plate that is read as noisy slopes at places on a grid."""

    def __init__(self):
        rng, modes = np.random.default_rng(0), fe.modes(PLATE, TRUE)
        places = np.stack(np.meshgrid(np.linspace(20, 234, 18), np.linspace(20, 160, 13)), -1)
        slopes = modes.slope(places.reshape(-1, 2)).transpose(1, 0, 2).reshape(TRUE, -1)
        # As many numbers as modes that are known, in units of their noise: 2e-4 a slope.
        turned = np.linalg.qr(slopes[:KNOWN].T)[0]
        self.true, self.readings = modes, slopes @ turned / 2e-4
        self.known = fe.modes(PLATE, KNOWN)
        self.seeing = Seeing(self.known, self.readings[:KNOWN])
        self.estimator = Estimator(modal(self.known, self.readings[:KNOWN]), max_touches=2)
        dynamics = models.plate_dynamics(self.known, DENSITY, DAMPING)
        self.ringing = RingingPlate(self.known, dynamics, EXPOSURE)
        self.omega = np.sqrt(modes.stiffness / (1e-12 * DENSITY * PLATE.thickness))
        self.rng = rng

    def frames(self, place, force, rate, duration):
        """Integrate the modes under a force by the implicit midpoint rule."""
        response = self.true.response(np.array([place]))[0]
        q, speed = np.zeros(TRUE), np.zeros(TRUE)
        summed = [np.zeros(TRUE)]
        square, viscous = self.omega**2, 2 * DAMPING * self.omega
        for k in range(round(duration / STEP)):
            push = square * (response * force((k + 0.5) * STEP) - q) - viscous * speed
            change = STEP * push / (1 + STEP / 2 * viscous + STEP**2 / 4 * square)
            change -= STEP**2 / 2 * square * speed / (1 + STEP / 2 * viscous + STEP**2 / 4 * square)
            after = q + STEP * (speed + change / 2)
            summed.append(summed[-1] + STEP * (q + after) / 2)
            q, speed = after, speed + change
        exposed = round(EXPOSURE / STEP)
        for end in range(exposed, len(summed), round(1 / rate / STEP)):
            mean = (summed[end] - summed[end - exposed]) / EXPOSURE
            yield end * STEP, mean @ self.readings + self.rng.standard_normal(KNOWN)

    def follow(self, frames):
        state = InTime()
        for time, measured in frames:
            found, state = models.estimate_in_time(
                self.ringing, self.estimator, self.seeing, measured, state, time
            )
            yield time, measured, found, state


@pytest.fixture(scope="module")
def bench():
    return Bench()


def tap(largest, begins, duration):
    return lambda time: largest * np.sin(np.pi * np.clip((time - begins) / duration, 0, 1))


@pytest.mark.parametrize(
    ("duration", "off", "rung"), [(0.1, 0.02, 0), (0.05, 0.05, 1), (0.02, 0.15, 3)]
)
def test_the_largest_force_of_a_tap_is_known_and_nothing_is_left_of_it(bench, duration, off, rung):
    begins, place = 0.0531, (90.0, 110.0)
    frames = bench.frames(place, tap(0.8, begins, duration), 120.0, 0.4)
    taps, after, alone = [], 0, 0
    for time, measured, found, state in bench.follow(frames):
        taps += state.taps
        if time - EXPOSURE > begins + duration:
            after += found.count
            alone += bench.estimator.fit_whitened(measured).count
    assert alone >= rung  # a frame by itself takes the ringing for touches
    assert after == 0
    (tapped,) = taps
    assert tapped.force == pytest.approx(0.8, rel=off)
    assert abs(tapped.force - 0.8) < 4 * tapped.sigma[2]
    assert np.hypot(tapped.x - place[0], tapped.y - place[1]) < 2.0
    assert abs(tapped.time - begins - duration / 2) < 0.2 * duration


def test_forces_of_short_taps_lie_within_what_is_stated(bench):
    """Frames in which a force changes as much as in any other: nobody knows how fast it does."""
    scaled = []
    for begins in np.linspace(0.05, 0.07, 9):
        force = tap(0.8, begins, 0.03)
        for time, _, found, _ in bench.follow(bench.frames((90.0, 110.0), force, 40.0, 0.16)):
            ages = time - EXPOSURE * (np.arange(40) + 0.5) / 40
            true = force(ages).mean()
            if found.count == 1 and true > 0.1:
                scaled.append((found.force[0] - true) / found.touch_covariance(0)[2, 2] ** 0.5)
    assert len(scaled) >= 9
    assert np.sqrt(np.mean(np.square(scaled))) < 1.5


def test_filters_are_averaged_with_what_they_differ_by():
    rng, weights = np.random.default_rng(5), np.array([0.6, 0.3, 0.1])
    filters = []
    for rank in (3, 4, 5):
        touches = np.concatenate([rng.normal(100.0, 0.5, (2, 2)), np.zeros((2, 2))], axis=1)
        vibration = replace(at_rest(6), touches=touches)
        forces, factor = rng.normal(1.0, 0.2, 2), rng.normal(0.0, 0.3, (2, 3, rank))
        filters.append(Followed(vibration, np.zeros(6), forces, factor, np.zeros((2, 2)), 0.0, 0.0))
    found = averaged(filters, weights)
    which = rng.choice(3, 200_000, p=weights)
    drawn = np.empty((len(which), 2))
    for k, one in enumerate(filters):
        own = rng.standard_normal((int((which == k).sum()), one.touch_factor.shape[2]))
        drawn[which == k] = one.forces + own @ one.touch_factor[:, 2].T
    covariance = found.touch_factor[:, 2] @ found.touch_factor[:, 2].T
    np.testing.assert_allclose(found.forces, drawn.mean(axis=0), atol=0.01)
    np.testing.assert_allclose(covariance, np.cov(drawn.T), atol=0.01)


def test_a_tap_between_two_frames_is_stated_without_a_force(bench):
    # It begins after an exposure and is over before the next, a thirtieth of a second later.
    frames = bench.frames((90.0, 110.0), tap(0.8, 0.0735, 0.02), 30.0, 0.5)
    taps = [one for _, _, _, state in bench.follow(frames) for one in state.taps]
    assert taps
    assert all(np.isnan(one.force) and one.at_least < 0.8 for one in taps)


def test_a_touch_that_rests_is_as_it_was(bench):
    exact = 1.1 * bench.true.response(np.array([[150.0, 60.0]]))[0] @ bench.readings
    frames = [(k / 30, exact + bench.rng.standard_normal(KNOWN)) for k in range(20)]
    start = np.empty((0, 3))
    for number, (_, measured, found, state) in enumerate(bench.follow(frames)):
        alone = bench.estimator.fit_whitened(measured, start)
        start = np.column_stack([alone.xy, alone.force])
        if number != 1:  # nobody knows whether what is there in the first frame has just landed
            np.testing.assert_allclose(found.xy, alone.xy, atol=1e-6)
            np.testing.assert_allclose(found.force, alone.force, rtol=1e-6)
        assert state.bank is None


def test_a_touch_that_lands_and_rests_is_soon_looked_at_frame_by_frame(bench):
    landing = bench.frames((90.0, 110.0), lambda time: 0.8 * np.clip(time / 0.05, 0, 1), 60.0, 0.8)
    rested = [state.bank is None for time, _, _, state in bench.follow(landing) if time > 0.7]
    assert all(rested)


def test_two_taps_at_once_are_two(bench):
    first = bench.frames((70.0, 60.0), tap(0.8, 0.05, 0.08), 120.0, 0.3)
    second = bench.frames((190.0, 120.0), tap(0.5, 0.06, 0.08), 120.0, 0.3)
    both = [(t, a + b) for (t, a), (_, b) in zip(first, second, strict=True)]
    taps = [one for _, _, _, state in bench.follow(both) for one in state.taps]
    found = sorted(one.force for one in taps)
    np.testing.assert_allclose(found, [0.5, 0.8], rtol=0.1)


def test_frames_out_of_order_and_pauses_are_frames_by_themselves(bench):
    exact = 1.1 * bench.true.response(np.array([[150.0, 60.0]]))[0] @ bench.readings
    for times in ((1.0, 0.9), (1.0, 1.0), (1.0, 9.0)):
        frames = [(time, exact + bench.rng.standard_normal(KNOWN)) for time in times]
        found = [one for _, _, one, _ in bench.follow(frames)]
        assert [one.count for one in found] == [1, 1]


def test_damping_and_pitch_are_learned_from_the_ringing(bench):
    frames = bench.frames((90.0, 110.0), tap(4.0, 0.02, 0.02), 60.0, 0.5)
    rung = [(time, measured) for time, measured in frames if time - EXPOSURE > 0.041]
    supposed = models.plate_dynamics(bench.known, 1250.0, 0.05)
    times, measured = (np.array(part) for part in zip(*rung, strict=True))
    found = models.learn_damping(supposed, bench.seeing, measured, times, EXPOSURE)
    assert abs(found.damping - DAMPING) < 4 * found.sigma[1] + 2e-4
    np.testing.assert_allclose(found.dynamics.omega[0], bench.omega[0], rtol=2e-3)


def test_a_plate_that_hardly_rings_teaches_nothing(bench):
    dynamics, quiet = bench.ringing.dynamics, bench.rng.standard_normal((9, KNOWN))
    with pytest.raises(ValueError, match="tap it harder"):
        models.learn_damping(dynamics, bench.seeing, quiet, 0.1 * np.arange(9), EXPOSURE)
    with pytest.raises(ValueError, match="4 frames"):
        models.learn_damping(dynamics, bench.seeing, quiet[:3], 0.1 * np.arange(3), EXPOSURE)


@pytest.mark.parametrize("missing", [range(6, 15), range(4, 26), range(3, 60, 3)])
def test_frames_may_be_missing_after_a_landing(bench, missing):
    """Longer than forces are kept for: the frames since a landing are passed again all the same."""
    frames = bench.frames((90.0, 110.0), lambda time: 0.8 * (time > 0.1), 30.0, 2.2)
    seen = [frame for number, frame in enumerate(frames) if number not in missing]
    *_, (_, _, found, _) = bench.follow(seen)
    assert found.count == 1
    assert found.force[0] == pytest.approx(0.8, rel=0.02)

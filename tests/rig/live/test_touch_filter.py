"""The filter of a touch, on paths that are known and noise that is drawn."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from models.estimate import Estimate, Result
from rig.live.touch_filter import STILL, landed
from rig.live.tracks import Tracks

RATE = 30.0
SIGMA = np.array([0.4, 0.25, 0.05])  # mm, mm, N


def followed(path, seconds=2.0, rate=RATE, touches=24, after=1.0, seed=1):
    """Errors (K, 3) of single frames and of the filter, and its stated σ (K, 3), after 1 s."""
    rng = np.random.default_rng(seed)
    raw, smooth, stated = [], [], []
    for _ in range(touches):
        posterior = None
        for k in range(round(seconds * rate)):
            truth = np.array(path(k / rate), dtype=float)
            seen, spread = truth + SIGMA * rng.standard_normal(3), np.diag(SIGMA**2)
            if posterior is None:
                posterior = landed(seen, spread)
            else:
                posterior = posterior.predict(1 / rate).update(seen, spread)
            if k / rate >= after:
                found, covariance = posterior.seen
                raw.append(seen - truth)
                smooth.append(found - truth)
                stated.append(np.sqrt(np.diag(covariance)))
    return np.array(raw), np.array(smooth), np.array(stated)


def rms(values):
    return np.sqrt(np.mean(np.square(values), axis=0))


@pytest.mark.parametrize("rate", [30.0, 120.0])
def test_a_touch_that_rests_is_averaged(rate):
    raw, smooth, stated = followed(lambda t: (100.0, 60.0, 2.0), rate=rate)
    assert (rms(smooth)[:2] < 0.3 * rms(raw)[:2]).all()  # measured 0.19 and 0.10
    assert rms(smooth)[2] < 0.5 * rms(raw)[2]  # measured 0.39 and 0.31
    assert (rms(smooth / stated) < 1.2).all()  # σ is not too small
    assert (np.abs(smooth.mean(axis=0)) < 0.2 * SIGMA).all()


def test_a_touch_that_slides_is_not_held_back():
    raw, smooth, _ = followed(lambda t: (20.0 + 160.0 * t, 200.0 - 120.0 * t, 2.0))
    assert (rms(smooth)[:2] < 1.03 * rms(raw)[:2]).all()
    along = smooth[:, :2].mean(axis=0) @ [0.8, -0.6]
    assert abs(along) < 200.0 * 0.005  # mm, a lag of 5 ms; measured 0.1 mm


def test_a_circle_costs_nothing():
    raw, smooth, stated = followed(
        lambda t: (100 + 40 * np.cos(5 * t), 90 + 40 * np.sin(5 * t), 2.0)
    )
    assert (rms(smooth)[:2] < 1.05 * rms(raw)[:2]).all()
    assert (rms(smooth / stated) < 1.2).all()


def test_a_tap_is_as_high_as_each_frame_says():
    raw, smooth, _ = followed(lambda t: (100.0, 60.0, 2.0 + 1.5 * np.sin(40 * t)))
    assert rms(smooth)[2] < 1.1 * rms(raw)[2]
    assert (rms(smooth)[:2] < 0.4 * rms(raw)[:2]).all()


def test_it_says_that_a_resting_finger_rests():
    posterior = landed(np.array([50.0, 40.0, 2.0]), np.diag(SIGMA**2))
    for _ in range(30):
        posterior = posterior.predict(1 / RATE).update(
            np.array([50.0, 40.0, 2.0]), np.diag(SIGMA**2)
        )
    assert np.argmax(posterior.weights) == STILL
    assert np.hypot(*posterior.mean[2:4]) < 1.0


@given(
    st.lists(st.floats(0.001, 2.0), min_size=1, max_size=8),
    st.floats(-300, 300),
    st.floats(0.01, 1e3),
)
@settings(max_examples=40)
def test_weights_are_probabilities_and_covariances_stay_positive(steps, jump, sigma):
    posterior = landed(np.array([50.0, 40.0, 2.0]), np.diag(SIGMA**2))
    for k, step in enumerate(steps):
        seen = np.array([50.0 + jump * (k % 2), 40.0, 2.0])
        posterior = posterior.predict(step).update(seen, sigma**2 * np.eye(3))
        assert posterior.weights.sum() == pytest.approx(1.0)
        assert (posterior.weights >= 0).all()
        assert np.linalg.eigvalsh(posterior.covariance).min() > -1e-9
        assert np.isfinite(posterior.mean).all()


def test_a_track_says_where_its_finger_will_be():
    tracks, rng = Tracks(), np.random.default_rng(2)
    for k in range(40):
        place = np.array([[20 + 200.0 * k / RATE, 80.0]]) + rng.normal(0, 0.2, (1, 2))
        spread = np.diag([0.04, 0.04, 0.0025])
        seen = Estimate(place, np.array([2.0]), spread, 1.0, 1, 0.5, Result.FOUND)
        tracks, _, _ = tracks.follow(seen, k / RATE)
    expected, spread = tracks.tracks[0].at(39 / RATE + 0.06)
    assert expected[0] == pytest.approx(20 + 200.0 * (39 / RATE + 0.06), abs=2.0)
    assert spread[0, 0] > 0.04


def test_what_all_frames_err_by_alike_is_not_averaged():
    rng, noise = np.random.default_rng(3), np.diag(SIGMA**2)
    systematic = np.diag([0.3, 0.2, 0.06]) ** 2
    within, sigma = [], []
    for _ in range(40):
        tracks, off = Tracks(), np.sqrt(np.diag(systematic)) * rng.standard_normal(3)
        for k in range(30):
            seen = np.array([100.0, 60.0, 2.0]) + off + SIGMA * rng.standard_normal(3)
            whole = noise + systematic
            estimate = Estimate(
                seen[None, :2], seen[2:], whole, 1.0, 1, 0.5, Result.FOUND, systematic=systematic
            )
            tracks, _, _ = tracks.follow(estimate, k / RATE)
        (track,) = tracks.tracks
        found, covariance = track.at(29 / RATE)
        sigma.append(np.sqrt(np.diag(covariance)))
        within.append((found - [100.0, 60.0, 2.0]) / sigma[-1])
    assert rms(np.array(within)) == pytest.approx(1.0, abs=0.3)
    assert (np.array(sigma) >= np.sqrt(np.diag(systematic))).all()
    assert (np.median(sigma, axis=0) < np.sqrt(np.diag(systematic + 0.3 * noise))).all()


def test_frames_out_of_order_change_nothing_but_what_they_say():
    tracks = Tracks()
    seen = Estimate(
        np.array([[20.0, 30.0]]), np.array([2.0]), np.diag([0.04, 0.04, 0.0025]), 1.0, 1, 0.5,
        Result.FOUND,
    )  # fmt: skip
    for time in (0.0, 0.033, 0.02, 0.066):
        tracks, names, _ = tracks.follow(seen, time)
        assert names == (1,)
    assert tracks.tracks[0].at(0.07)[0] == pytest.approx([20.0, 30.0, 2.0], abs=1e-6)

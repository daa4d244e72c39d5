"""A reference of a plate that nothing moved, and drift that is no touch."""

import time
from dataclasses import replace

import numpy as np
import pytest

import fe
from rig.live.baseline import (
    MISFIT_RATE,
    average_reference,
    drift_weight,
    is_consistent,
    moved_during_reference,
    still_reference,
)
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import NO_ESTIMATE, estimate_frame
from rig.live.strain_chain import sense_strain, with_strain
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch


def still_frames(rng, count=16, shape=(180, 260)):
    image = rng.uniform(40, 200, shape)
    return [image + rng.normal(0, 2.0, shape) for _ in range(count)]


def test_noise_and_a_flickering_lamp_are_no_motion(rng):
    for _ in range(20):
        frames = [frame + rng.normal(0, 3.0) for frame in still_frames(rng)]
        assert not moved_during_reference(frames)


@pytest.mark.parametrize("flicker", [0.0, 0.03, 0.1])
def test_a_lamp_that_flickers_is_no_noise(rng, flicker):
    """Motion is read without the light of each tile, so that nothing errs by it."""
    scene = 60.0 + 100.0 * rng.random((64, 96))
    lamps = 1.0 + flicker * rng.standard_normal(16)
    frames = [lamp * scene + rng.normal(0.0, 2.0, scene.shape) for lamp in lamps]
    reference = average_reference(frames)
    assert reference.noise == pytest.approx(2.0 * np.sqrt(17 / 16), rel=0.02)
    np.testing.assert_allclose(np.sqrt(reference.curve), reference.noise, rtol=0.05)
    np.testing.assert_allclose(reference.image, lamps.mean() * scene, atol=3.0)


def test_a_finger_that_lands_meanwhile_is_motion(rng):
    frames = still_frames(rng)
    for frame in frames[10:]:
        frame[60:80, 100:125] += 5.0
    assert moved_during_reference(frames)


def test_kept_images_in_which_something_moves_are_no_reference(rng):
    frames = still_frames(rng)
    np.testing.assert_array_equal(still_reference(frames).image, average_reference(frames).image)
    for frame in frames[10:]:
        frame[60:80, 100:125] += 5.0
    with pytest.raises(ValueError, match="something moves in the first 16 images"):
        still_reference(frames)


@pytest.fixture
def lit_unevenly(rng):
    """Frames of a pattern between bright clamps in a dark surround, noisy as it is bright."""
    light = np.full((180, 260), 4.0)
    light[30:150, 30:230] = rng.uniform(40, 120, (120, 200))
    light[60:120, 200:250] = 240.0
    return [light + 0.4 * np.sqrt(light) * rng.standard_normal(light.shape) for _ in range(16)]


def test_bright_clamps_and_a_dark_surround_are_no_motion(lit_unevenly, rng):
    assert not moved_during_reference(lit_unevenly)
    grey = [np.rint(frame).clip(0, 255).astype(np.uint8) for frame in lit_unevenly]
    assert not moved_during_reference(grey)
    flickering = [frame * (1 + rng.normal(0, 0.02)) for frame in lit_unevenly]
    assert not moved_during_reference(flickering)


def test_a_shadow_that_moves_in_the_dark_is_motion_beside_noisy_clamps(lit_unevenly):
    for frame in lit_unevenly[9:]:
        frame[150:180, 40:90] += 1.0
    assert moved_during_reference(lit_unevenly)


def test_frames_without_noise_are_no_motion():
    assert not moved_during_reference([np.full((40, 60), 200, np.uint8)] * 16)


def test_a_frame_is_a_misfit_by_noise_once_in_a_thousand_hours():
    alarms = MISFIT_RATE * 30 * 3600 * 1000  # frames in that time, at 30 a second
    assert alarms == pytest.approx(1.0)
    touchless = replace(NO_ESTIMATE, chi2=400.0, dof=200)
    assert is_consistent(replace(touchless, p_value=1.01 * MISFIT_RATE))
    assert not is_consistent(replace(touchless, p_value=0.99 * MISFIT_RATE))


def test_the_weight_of_a_frame_grows_with_the_time_since_the_last():
    assert drift_weight(0.0) == drift_weight(-1.0) == 0.0
    assert drift_weight(10.0) == pytest.approx(1 - np.exp(-1))
    assert drift_weight(1 / 30) == pytest.approx(1 / 300, rel=0.01)


class Creeping:
    """The small twin whose plate creeps under a load that nobody calls a touch."""

    def __init__(self, scene):
        self.twin = build_twin(scene)
        bench = build_bench(scene, lambda done, total: None)
        self.chain, self.strain = bench.prepare(
            average_reference([self.twin.frame(k, ()) for k in range(16)])
        )

    def run(self, loads, settling, touch=(), speck=()):
        """Estimates of a frame a second under growing loads, N; a speck lies on rows, columns."""
        state, watch, found = at_rest(self.chain), Stopwatch(time.monotonic), []
        for index, load in enumerate(loads):
            touches = (fe.Touch(70.0, 140.0, load, 30.0), *touch)
            image = self.twin.frame(20 + index, touches).copy()
            image[speck or np.s_[:0]] = 0
            frame_estimate = estimate_frame(self.chain, image, state, watch, settling)
            assert frame_estimate.hidden.any() == bool(speck)
            state = frame_estimate.state
            found.append(frame_estimate.estimate)
        return found


@pytest.fixture
def creeping(small):
    return Creeping(small())


def test_slow_drift_is_no_touch_and_without_settling_it_is(creeping):
    loads = np.linspace(0.005, 0.8, 60)  # N, in a minute
    assert not any(estimate.count for estimate in creeping.run(loads, drift_weight(1.0)))
    assert any(estimate.count for estimate in creeping.run(loads[-3:], 0.0))


def test_slow_drift_is_no_touch_where_a_speck_has_settled_on_the_plate(creeping):
    height, width = creeping.twin.frame(0, ()).shape
    speck = np.s_[height // 3 : height // 3 + 12, width // 4 : width // 4 + 12]
    loads = np.linspace(0.005, 0.8, 60)
    found = creeping.run(loads, drift_weight(1.0), speck=speck)
    assert not any(estimate.count for estimate in found)


def test_a_touch_that_stays_is_never_taken_for_rest(creeping):
    press = fe.Touch(180.0, 60.0, 2.0)
    found = creeping.run([0.001] * 40, drift_weight(1.0), (press,))
    assert {estimate.count for estimate in found} == {1}
    assert found[-1].force[0] == pytest.approx(2.0, abs=0.2)


def test_a_touch_on_a_plate_that_has_crept_is_found_where_it_is(creeping):
    drift = list(np.linspace(0.005, 0.8, 60))
    press = fe.Touch(180.0, 60.0, 2.0)
    state, watch = at_rest(creeping.chain), Stopwatch(time.monotonic)
    for index, load in enumerate([*drift, *drift[-1:] * 40]):
        image = creeping.twin.frame(20 + index, (fe.Touch(70.0, 140.0, load, 30.0),))
        state = estimate_frame(creeping.chain, image, state, watch, drift_weight(1.0)).state
    touched = (fe.Touch(70.0, 140.0, drift[-1], 30.0), press)
    image = creeping.twin.frame(200, touched)
    estimate = estimate_frame(creeping.chain, image, state, watch).estimate
    assert estimate.count == 1
    error = np.abs([*(estimate.xy[0] - (180.0, 60.0)), estimate.force[0] - 2.0])
    assert (error < 4.5 * np.sqrt(np.diag(estimate.covariance))).all()
    fresh = replace(state, rest=np.zeros_like(state.rest))
    blind = estimate_frame(creeping.chain, image, fresh, watch).estimate
    assert blind.count != 1 or np.abs(blind.force[0] - 2.0) > 0.1


def test_slow_drift_is_no_touch_in_strain_either(creeping):
    state, watch = at_rest(creeping.chain), Stopwatch(time.monotonic)
    for index, load in enumerate(np.linspace(0.005, 0.8, 60)):
        image = creeping.twin.frame(20 + index, (fe.Touch(70.0, 140.0, load, 30.0),))
        frame_estimate = estimate_frame(creeping.chain, image, state, watch, drift_weight(1.0))
        frame_estimate = with_strain(creeping.strain, frame_estimate, watch)
        assert frame_estimate.from_strain.count == 0
        state = frame_estimate.state
    fresh = replace(state, rest=np.zeros_like(state.rest))
    assert sense_strain(creeping.strain, frame_estimate.sums, fresh, watch)[1].count == 1

"""The live chain: from frames to touches, from one frame to the next."""

import time
from dataclasses import replace

import numpy as np
import pytest

import fe
from rig.live.alignment import Alignment
from rig.live.baseline import MIN_NOISE, average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.live.registration import MAX_ITERATIONS
from rig.live.strain_chain import sense_strain, with_strain
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch

PRESS = (fe.Touch(90.0, 120.0, 3.0),)


class Rig:
    """Bench and twin of a scene, its chains prepared from the first frames."""

    def __init__(self, scene):
        self.twin = build_twin(scene)
        frames = [self.twin.frame(k, ()) for k in range(16)]
        self.chain, self.strain = build_bench(scene, lambda done, total: None).prepare(
            average_reference(frames)
        )
        self.state = at_rest(self.chain)
        self.watch = Stopwatch(time.monotonic)

    def sense(self, sequence, touches, hand=None):
        image = self.twin.frame(sequence, touches)
        if hand is not None:
            image[hand] = 0
        sensed = estimate_frame(self.chain, image, self.state, self.watch)
        self.state = sensed.state
        return sensed.estimate, sensed.sums


@pytest.fixture
def rig(small):
    return Rig(small())


def deviation(estimate, touch):
    """Error of the one touch found, in its own standard deviations: x, y, F."""
    error = [*(estimate.xy[0] - (touch.x, touch.y)), estimate.force[0] - touch.force]
    return np.array(error) / np.sqrt(np.diag(estimate.covariance))


def test_the_reference_is_the_mean_of_its_frames_and_knows_the_noise_of_one():
    rng = np.random.default_rng(0)
    truth = rng.uniform(50, 200, (60, 80))
    frames = [truth + rng.normal(0, 3.0, truth.shape) for _ in range(8)]
    zero = average_reference(frames)
    np.testing.assert_allclose(zero.image, np.mean(frames, axis=0), rtol=1e-6)
    assert zero.image.dtype == np.float32
    assert zero.noise == pytest.approx(3.0 * np.sqrt(1 + 1 / 8), rel=0.02)


def test_frames_without_noise_leave_the_noise_of_rounding():
    assert average_reference([np.full((20, 30), 7, np.uint8)] * 4).noise == MIN_NOISE


def test_one_frame_is_no_reference():
    with pytest.raises(ValueError, match=r"2 frames or more.*got 1; set dic\.reference_frames"):
        average_reference([np.zeros((20, 30), np.uint8)])


def test_nothing_is_found_on_an_untouched_plate(rig):
    assert [rig.sense(sequence, ())[0].count for sequence in range(20, 40)] == [0] * 20


def test_a_press_is_found_within_its_own_uncertainty(rig):
    for sequence in range(20, 30):
        estimate, _ = rig.sense(sequence, PRESS)
        assert estimate.count == 1
        assert (np.abs(deviation(estimate, PRESS[0])) < 4.5).all()
    assert np.abs(estimate.xy[0] - (90.0, 120.0)).max() < 3.0  # mm; its σ is 0.7 mm


def test_the_next_frame_starts_from_the_last_and_forgets_a_touch_that_leaves(rig):
    rig.sense(20, PRESS)
    np.testing.assert_allclose(rig.state.touches[0], (90.0, 120.0, 3.0), atol=3.0)
    assert rig.sense(21, ())[0].count == 0
    assert rig.state.touches.shape == (0, 3)


def test_the_state_follows_from_the_frame_alone(rig):
    """A frame sensed twice gives the same touches, whatever state it starts from."""
    fresh, _ = rig.sense(20, PRESS)
    moved, _ = rig.sense(20, PRESS)
    np.testing.assert_allclose(moved.xy, fresh.xy, atol=0.15)  # mm, a fifth of σ
    np.testing.assert_allclose(moved.force, fresh.force, atol=0.01)


@pytest.mark.parametrize("shift", [(0.3, 0.0), (-1.2, 0.8)])
def test_a_camera_that_moves_is_no_touch_and_hides_none(small, shift):
    rig = Rig(small({"source.shift": list(shift)}))
    empty, _ = rig.sense(40, ())
    assert empty.count == 0
    motion = rig.state.motion[rig.chain.pattern.count :]
    assert motion[:2] == pytest.approx(shift, abs=0.02)  # px, the first two rigid motions
    pressed, _ = rig.sense(41, PRESS)
    assert (np.abs(deviation(pressed, PRESS[0])) < 4.5).all()


def test_only_a_jump_takes_more_passes_than_one(small):
    rig = Rig(small({"source.shift": [1.2, 0.0]}))
    passes = []
    for sequence in (20, 21, 40, 41):
        rig.watch = Stopwatch(time.monotonic)
        rig.sense(sequence, ())
        passes.append(len(rig.watch._durations["correlate"]))
    assert passes[0] == passes[1] == passes[3] == 1
    assert 1 < passes[2] <= MAX_ITERATIONS + 1  # one of them where it jumped from


def test_strain_tells_the_same_touch(rig):
    estimate, sums = rig.sense(20, PRESS)
    strain, found = sense_strain(rig.strain, sums, rig.state, rig.watch)
    assert strain.shape == (len(sums.e), 3)
    assert found is not None
    assert found.count == 1
    assert (np.abs(deviation(found, PRESS[0])) < 4.5).all()
    assert np.linalg.norm(found.xy[0] - estimate.xy[0]) < 4.0
    begun = replace(rig.state, from_strain=np.column_stack([found.xy, found.force]))
    again = sense_strain(rig.strain, sums, begun, rig.watch)[1]
    assert again is not None
    np.testing.assert_allclose(again.xy, found.xy, atol=0.1)


def test_known_presses_correct_every_touch_and_leave_what_the_next_frame_starts_from(rig):
    sensed = estimate_frame(rig.chain, rig.twin.frame(20, PRESS), rig.state, rig.watch)
    sensed = replace(sensed, from_pattern=sensed.estimate)
    moved = Alignment(np.array([[1.0, 0.0, 3.0], [0.0, 1.0, -2.0]]), 1.1, 0.1, 0.01, 0.01, ())
    plain = with_strain(rig.strain, sensed, rig.watch)
    corrected = with_strain(rig.strain, sensed, rig.watch, moved)
    for name in ("estimate", "from_strain", "from_pattern"):
        before, after = getattr(plain, name), getattr(corrected, name)
        np.testing.assert_allclose(after.xy, before.xy + np.array([3.0, -2.0]))
        np.testing.assert_allclose(after.force, 1.1 * before.force)
    np.testing.assert_array_equal(corrected.state.from_strain, plain.state.from_strain)
    np.testing.assert_array_equal(corrected.state.touches, plain.state.touches)


def test_under_a_hand_there_is_no_strain_and_no_touch_from_it(rig):
    _, sums = rig.sense(20, (), hand=np.s_[100:180, 120:200])
    strain, found = sense_strain(rig.strain, sums, rig.state, rig.watch)
    tiles = rig.chain.reference.tiles.xy
    covered = ((tiles > (130, 110)) & (tiles < (190, 170))).all(axis=1)
    assert np.isnan(strain[covered]).all()
    far = (np.abs(tiles - (160, 140)) > 90).any(axis=1)
    known = np.isfinite(rig.strain.map.sigma[:, 0])
    assert np.isfinite(strain[far & known]).all()
    assert found is None


def test_each_stage_is_timed(rig):
    _, sums = rig.sense(20, PRESS)
    sense_strain(rig.strain, sums, rig.state, rig.watch)
    names = [name for name, _, _ in rig.watch.table()]
    assert names == ["correlate", "mask", "estimate", "strain", "from strain"]

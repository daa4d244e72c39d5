"""A hand before the plate, a light that fails, a camera that is bumped: nothing is invented."""

import time
from dataclasses import replace

import numpy as np
import pytest
from skimage.registration import phase_cross_correlation

import fe
from dic import tile_sums
from rig.live import registration, visibility
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.live.registration import jumped
from rig.sources.twin import build_twin
from rig.system.timing import Stopwatch
from synthetic import Occluder

PRESS = fe.Touch(80.0, 120.0, 2.5)
ARM = np.array([(190.0, -20.0), (410.0, -20.0), (410.0, 340.0), (190.0, 340.0)])  # the right half


@pytest.fixture(scope="module")
def watch():
    return Stopwatch(time.monotonic)


class Rig:
    """Chain and twin of a scene; what stands before the plate is painted over its images."""

    def __init__(self, scene, watch):
        self.twin, self.watch = build_twin(scene), watch
        bench = build_bench(scene, lambda done, total: None)
        self.chain, self.strain = bench.prepare(
            average_reference([self.twin.frame(k, ()) for k in range(16)])
        )
        self.state = at_rest(self.chain)

    def process(self, sequence, touches=(), cover=lambda light: light):
        light = self.twin.frame(sequence, touches) / 255.0
        image = (255.0 * cover(light)).round().clip(0, 255).astype(np.uint8)
        found = estimate_frame(self.chain, image, self.state, self.watch)
        self.state = found.state
        return found


@pytest.fixture
def rig(small, watch):
    return Rig(small(), watch)


def test_a_hand_that_moves_over_half_the_plate_invents_no_touch(rig):
    for sequence in range(20, 44):
        hand = Occluder(ARM + np.array([8.0 * (32 - sequence), 5.0 * (sequence - 30)]), 0.45)
        found = rig.process(sequence, (), hand.cover)
        assert found.estimate.count == 0, sequence
        assert not found.unusable_reason
        covered = hand.coverage((320, 384)).mean()
        assert covered - 0.05 < found.hidden.mean() < covered + 0.15


def test_a_press_beside_the_hand_is_found_and_nothing_else_is_looked_for(rig, monkeypatch):
    monkeypatch.setattr(
        registration, "coarse_shift", lambda reference, image: pytest.fail("no camera jumped")
    )
    hand = Occluder(ARM, 0.45)
    for sequence in range(20, 28):
        found = rig.process(sequence, (PRESS,), hand.cover)
        assert found.estimate.count == 1
        error = [*(found.estimate.xy[0] - (PRESS.x, PRESS.y)), found.estimate.force[0] - 2.5]
        assert (np.abs(error) < 4.5 * np.sqrt(np.diag(found.estimate.covariance))).all()
    assert np.hypot(*error[:2]) < 4.0  # mm
    assert rig.process(30).estimate.count == 0  # the hand has gone, and so has the finger


def test_a_plate_that_is_wholly_covered_says_so_and_goes_on_after(rig):
    before = rig.process(20, (PRESS,)).state
    strange = np.random.default_rng(3).uniform(0.2, 0.8, (320, 384))
    covered = rig.process(21, (PRESS,), lambda light: strange)
    assert (
        covered.unusable_reason
        == "100% of the pattern is hidden; clear the view, focus the camera or put it back"
    )
    assert covered.estimate.count == 0
    np.testing.assert_array_equal(covered.state.motion, before.motion)
    again = rig.process(22, (PRESS,))
    assert (again.unusable_reason, again.estimate.count) == ("", 1)


def test_tiles_too_few_for_the_fields_of_the_plate_are_no_fault_of_the_loop(rig, monkeypatch):
    def too_few(hidden):
        raise ValueError("48% of the tiles are hidden, and the others cannot tell; clear the view")

    monkeypatch.setattr(rig.chain.masked_models, "pattern_for", too_few)
    found = rig.process(20, (PRESS,))
    assert found.unusable_reason.endswith("cannot tell; clear the view")
    assert found.estimate.count == 0


@pytest.mark.parametrize("light", [0.05, 0.2])
def test_without_light_no_touch_is_reported(rig, light):
    dark = rig.process(20, (PRESS,), lambda image: light * image)
    assert dark.unusable_reason == "the pattern is too faint to follow; look after the light"
    assert dark.estimate.count == 0
    assert rig.process(21, (PRESS,)).estimate.count == 1


@pytest.mark.parametrize("light", [0.6, 1.1])
def test_a_light_that_changes_hides_nothing(rig, light):
    found = rig.process(20, (PRESS,), lambda image: light * image)
    assert found.hidden.mean() < 0.02
    assert found.estimate.count == 1
    assert np.hypot(*(found.estimate.xy[0] - (PRESS.x, PRESS.y))) < 4.0


@pytest.mark.parametrize("shift", [(3.0, -2.0), (-6.3, 4.4)])
def test_a_bumped_camera_is_no_touch_and_a_press_after_it_is_found(small, watch, shift):
    rig = Rig(small({"source.shift": list(shift)}), watch)
    assert rig.process(20).estimate.count == 0
    bumped = rig.process(40)
    assert (bumped.unusable_reason, bumped.estimate.count) == ("", 0)
    moved = bumped.state.motion[rig.chain.pattern.count :][:2]
    assert moved == pytest.approx(shift, abs=0.02)  # px
    pressed = rig.process(41, (PRESS,))
    assert pressed.estimate.count == 1
    assert np.hypot(*(pressed.estimate.xy[0] - (PRESS.x, PRESS.y))) < 4.0


def test_a_jump_is_seen_to_tenths_of_a_pixel_also_behind_a_hand(small, watch):
    rig = Rig(small({"source.shift": [4.6, -3.3]}), watch)
    hand = Occluder(ARM, 0.45)
    image = (255.0 * hand.cover(rig.twin.frame(40, ()) / 255.0)).astype(np.uint8)
    found = visibility.coarse_shift(rig.chain.reference, image)
    np.testing.assert_allclose(found, (4.6, -3.3), atol=0.35)
    found = estimate_frame(rig.chain, image, rig.state, rig.watch)
    assert (found.unusable_reason, found.estimate.count) == ("", 0)


@pytest.mark.parametrize("shift", [(4.6, -3.3), (-11.2, 6.7)])
def test_a_jump_is_what_an_independent_phase_correlation_finds(small, watch, shift):
    rig = Rig(small({"source.shift": list(shift)}), watch)
    image, still = rig.twin.frame(40, ()), rig.chain.reference.image
    found = visibility.coarse_shift(rig.chain.reference, image)
    back, _, _ = phase_cross_correlation(still, image.astype(float), upsample_factor=20)
    np.testing.assert_allclose(found, -back[::-1], atol=0.35)
    np.testing.assert_allclose(found, shift, atol=0.35)


def test_a_shadow_is_no_touch(rig):
    """A soft shadow dims a part of the plate by a fifth; it moves nothing."""
    x = np.arange(384.0)
    shade = 1.0 - 0.2 / (1.0 + np.exp((x - 200.0) / 25.0))
    for sequence in range(20, 26):
        found = rig.process(sequence, (), lambda light: light * shade)
        assert found.estimate.count == 0


def test_a_finger_that_comes_and_goes_in_the_shade_leaves_no_trace(rig):
    """In the shade a pass sees less than all that moved; the rest must not become a touch."""
    x, y = np.meshgrid(np.arange(384.0), np.arange(320.0))
    shade = 1.0 - 0.4 * np.exp(-(((x - 220) / 130) ** 2) - ((y - 160) / 150) ** 2)
    hard = fe.Touch(170.0, 90.0, 4.0)
    for sequence in range(20, 44):
        pressed = sequence // 3 % 2 == 1
        found = rig.process(sequence, (hard,) * pressed, lambda light: light * shade)
        assert found.estimate.count == pressed, sequence


def test_what_coarse_images_leave_of_a_jump_the_tiles_say_also_behind_a_hand(small, watch):
    rig = Rig(small({"source.shift": [3.4, -2.6]}), watch)
    image = (255.0 * Occluder(ARM + 60.0, 0.45).cover(rig.twin.frame(40, ()) / 255.0)).astype("u1")
    motion = rig.chain.pattern.still()
    motion[rig.chain.pattern.count :][:2] = 3.0, -2.3
    sums = tile_sums(rig.chain.reference, image, rig.chain.pattern.motions.flow(motion))
    np.testing.assert_allclose(visibility.tile_shift(rig.chain.tiles, sums), (0.4, -0.3), atol=0.15)
    found = jumped(rig.chain, image, rig.chain.pattern.still(), watch)
    np.testing.assert_allclose(found[rig.chain.pattern.count :][:2], (3.4, -2.6), atol=0.15)


def test_a_camera_that_is_shaken_loses_no_frame(small, watch, rng):
    rig, counts = Rig(small(), watch), []
    for sequence in range(20, 32):
        rig.twin = replace(rig.twin, shift=tuple(rng.uniform(-3.0, 3.0, 2)))
        found = rig.process(1000 + sequence, (PRESS,))
        assert not found.unusable_reason
        counts.append(found.estimate.count)
    assert set(counts) == {1}


def test_models_for_frames_of_less_noise_are_those_of_a_plate_seen_more_clearly(rig):
    """What is left out and how loud a frame is do not get into each other's way."""
    models, bare = rig.chain.masked_models, np.zeros(len(rig.chain.reference.hessian), bool)
    hidden = bare.copy()
    hidden[: len(hidden) // 5] = True
    touches = np.array([[150.0, 90.0, 2.0]])
    for mask in (hidden, bare, hidden):
        pattern, loud = models.for_frame(mask, 1.0)
        same, clear = models.for_frame(mask, 0.5)
        assert same is pattern
        assert np.array_equal(pattern.hidden, mask)
        assert models.for_frame(mask, 0.5)[1] is clear
        seen = loud.forward.read(touches)[0]
        assert clear.forward.read(touches)[0] == pytest.approx(2.0 * seen)
        rows = loud.candidates.response
        assert clear.candidates.response == pytest.approx(2.0 * rows, abs=1e-6 * abs(rows).max())
    assert models.for_frame(bare, 1.0)[1] is models.estimator

"""A hand before the camera: its tiles are left out, and the touches stay where they are."""

import numpy as np
import pytest
from scipy import ndimage

import models
import synthetic
from dic.tiles.preparation import prepare_tiles
from dic.tiles.tiles import tile_sums
from models import Result

NOISE = 2.0  # grey levels, as the bench of `conftest.py`
TOUCHES = np.array([[60.0, 70.0, 1.5]])
# Over a tenth of the image, in from a corner.
OUTLINE = np.array([(200.0, -20.0), (340.0, -20.0), (340.0, 110.0)])


def frame(bench, touches=(), hand=None, gain=1.0, seed=1, shift=(0.0, 0.0)):
    light = gain * bench.image(touches, shift=shift) / 255.0
    if hand is not None:
        light = hand.cover(light)
    return 255.0 * light + np.random.default_rng(seed).normal(0, NOISE, light.shape)


def sense(bench, image, passes=3):
    pattern, search, motion, start = bench.pattern, bench.search, bench.pattern.still(), ()
    for _ in range(passes):
        sums = tile_sums(bench.reference, image, pattern.motions.flow(motion))
        pattern = pattern.hiding(models.hidden_tiles(bench.reference, sums, NOISE))
        search = models.with_forward(search, pattern.forward(NOISE))
        right = pattern.gradient(sums, motion)
        estimate = models.find(pattern.whiten(right, NOISE), search, start=start, max_touches=3)
        start, motion = (
            np.column_stack([estimate.xy, estimate.force]),
            pattern.amplitudes(estimate, right),
        )
    return estimate, pattern


@pytest.mark.parametrize("noise", [1.0, 2.0, 5.0])
def test_the_noise_of_a_frame_is_known_without_light_motion_and_a_hand(bench, noise):
    hand, rng = synthetic.Occluder(OUTLINE, 0.1), np.random.default_rng(8)
    light = hand.cover(0.85 * bench.image(TOUCHES, shift=(0.06, 0.04)) / 255.0)
    image = 255.0 * light + rng.normal(0.0, noise, light.shape)
    fit = models.fit_tiles(bench.reference, tile_sums(bench.reference, image))
    everywhere = np.ones(len(fit.gain), dtype=bool)
    assert fit.noise(everywhere) == pytest.approx(noise, rel=0.05)
    assert fit.noise(~everywhere) == 0.0
    assert np.median(fit.contrast) == pytest.approx(0.85, abs=0.02)


@pytest.mark.parametrize("shade", [0.1, 0.5, 0.9])
def test_a_hand_is_hidden_and_the_rest_is_not(bench, shade):
    hand = synthetic.Occluder(OUTLINE, shade)
    image = frame(bench, TOUCHES, hand)
    hidden = models.hidden_tiles(bench.reference, tile_sums(bench.reference, image), NOISE)
    tiles = bench.reference.tiles
    covered = tiles.sums(hand.coverage(image.shape)) / tiles.size**2
    assert hidden[covered > 0.5].all()
    assert hidden[covered == 0.0].mean() < 0.1  # its neighbours, and little else


@pytest.mark.parametrize(
    "change",
    [{}, {"touches": TOUCHES}, {"gain": 0.85}]
    + [{"shift": (0.1 * k, -0.06 * k)} for k in range(1, 10)],
)
def test_touches_light_and_a_shifted_camera_hide_nothing(bench, change):
    image = frame(bench, **change)
    motion = bench.pattern.still()
    motion[bench.pattern.count : bench.pattern.count + 2] = change.get("shift", (0.0, 0.0))
    sums = tile_sums(bench.reference, image, bench.pattern.motions.flow(motion))
    assert not models.hidden_tiles(bench.reference, sums, NOISE).any()


def test_a_touch_is_found_beside_a_hand(bench):
    estimate, pattern = sense(bench, frame(bench, TOUCHES, synthetic.Occluder(OUTLINE, 0.5)))
    assert 0.05 < pattern.hidden.mean() < 0.3
    assert (estimate.result, estimate.count) == (Result.FOUND, 1)
    error = np.column_stack([estimate.xy, estimate.force]) - TOUCHES
    assert (np.abs(error).ravel() < 4 * np.sqrt(np.diag(estimate.covariance))).all()
    assert estimate.p_value > 1e-4


def test_a_hand_alone_is_no_touch(bench):
    for seed in range(5):
        image = frame(bench, hand=synthetic.Occluder(OUTLINE, 0.4), seed=seed)
        assert sense(bench, image)[0].result is Result.NO_TOUCH


def test_hidden_tiles_cost_information_and_none_is_as_before(bench):
    hidden = np.zeros(len(bench.reference.hessian), dtype=bool)
    assert bench.pattern.hiding(hidden) is bench.pattern
    hidden[: len(hidden) // 4] = True
    partial = bench.pattern.hiding(hidden)
    sigma = [
        np.sqrt(np.diag(models.covariance(pattern.forward(NOISE).read(TOUCHES)[1])))
        for pattern in (bench.pattern, partial)
    ]
    assert (sigma[1] > sigma[0]).all()
    back = partial.hiding(np.zeros_like(hidden))
    np.testing.assert_array_equal(back.normal, bench.pattern.normal)


@pytest.mark.parametrize("fraction", [0.2, 0.6])
def test_what_is_left_is_the_normal_matrix_of_the_visible_tiles(bench, fraction):
    hidden = np.random.default_rng(3).random(len(bench.reference.hessian)) < fraction
    basis = bench.pattern.motions.tile_basis()[~hidden]
    xx, xy, yy = bench.reference.hessian[~hidden].T[:, :, None]
    along_x, along_y = basis[:, 0], basis[:, 1]
    truth = along_x.T @ (xx * along_x + xy * along_y) + along_y.T @ (xy * along_x + yy * along_y)
    normal = bench.pattern.hiding(hidden).normal[: len(truth), : len(truth)]
    scale = np.sqrt(np.outer(np.diag(truth), np.diag(truth)))
    np.testing.assert_allclose(normal / scale, truth / scale, atol=1e-5)


def test_a_covered_camera_is_refused_in_one_sentence(bench):
    hidden = np.ones(len(bench.reference.hessian), dtype=bool)
    with pytest.raises(ValueError, match=r"^100% of the tiles are hidden, .*; clear the view$"):
        bench.pattern.hiding(hidden)


@pytest.mark.parametrize("prefilter", [0.0, 0.8])
def test_a_hard_print_that_moved_hides_nothing_and_a_hand_before_it_is_hidden(prefilter):
    """Blots of 2 px, drawn on a grid of an eighth of a px and moved there by half a pixel."""
    fine = ndimage.gaussian_filter(np.random.default_rng(4).normal(size=(8 * 168, 8 * 232)), 7.0)
    rest, moved = (
        np.roll(np.where(fine > 0, 220.0, 40.0), 4 * k, axis=1)
        .reshape(168, 8, 232, 8)
        .mean(axis=(1, 3))
        for k in (0, 1)
    )
    reference = prepare_tiles(rest, 16, prefilter)
    moved = moved + np.random.default_rng(5).normal(0, NOISE, rest.shape)
    flow = np.tile((0.5, 0.0), (len(reference.hessian), 1))
    assert not models.hidden_tiles(reference, tile_sums(reference, moved, flow), NOISE).any()
    covered = reference.tiles.xy[:, 0] > 140
    moved[:, 128:] = 90.0
    hidden = models.hidden_tiles(reference, tile_sums(reference, moved, flow), NOISE)
    assert hidden[covered].all()
    assert hidden[reference.tiles.xy[:, 0] < 104].mean() < 0.02

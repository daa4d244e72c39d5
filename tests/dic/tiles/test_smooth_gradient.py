import numpy as np
import pytest
from scipy import ndimage

import dic

FINE = 8  # samples along a side of a pixel
SIZE = 16
SHAPE = (160, 208)


def blots(seed, blur=1e-3):
    """Ink of blots of 2.5 px at 8 samples a px; `blur` of their edges, in samples."""
    shape = FINE * SHAPE[0], FINE * SHAPE[1]
    fine = np.random.default_rng(seed).normal(size=shape)
    fine = ndimage.gaussian_filter(fine, 9.0, mode="wrap")
    return ndimage.gaussian_filter(np.where(fine > 0, 220.0, 40.0), blur, mode="wrap")


def seen(ink, shift=(0, 0)):
    """Mean over pixels of ink that moved by some samples along x and y, round and round."""
    moved = np.roll(ink, shift[::-1], axis=(0, 1))
    return moved.reshape(SHAPE[0], FINE, SHAPE[1], FINE).mean(axis=(1, 3))


def motion(reference, frame, flow, block=1):
    """Motion (T, 2) px that blocks of tiles show beyond a flow."""
    blocks = dic.prepare_blocks(reference, block)
    sums = dic.tile_sums(reference, frame, np.tile(flow, (len(reference.hessian), 1)))
    field = dic.tile_displacement(blocks, sums, reference.motion_noise(1.0))
    return np.column_stack([field.u, field.v]) - flow


def errors(noise, prefilter, block):
    """Errors (n, T, 2) px of two prints that moved by sub-pixel steps, and the same over σ."""
    rng, found, over = np.random.default_rng(5), [], []
    for ink in (blots(3), blots(11)):
        reference = dic.prepare_tiles(seen(ink), SIZE, prefilter)
        blocks = dic.prepare_blocks(reference, block)
        sigma = reference.motion_noise(noise) * np.sqrt(blocks.inverse[:, [0, 1], [0, 1]])
        for shift in ((1, 6), (2, 3), (3, 7), (4, 4), (6, 1), (-3, 2)):
            frame = seen(ink, shift) + rng.normal(0.0, noise, SHAPE)
            found.append(motion(reference, frame, np.array(shift) / FINE, block))
            over.append(found[-1] / sigma)
    return np.array(found), np.array(over)


@pytest.mark.parametrize("noise", [2.0, 5.0])
def test_a_hard_print_errs_less_behind_the_chosen_filter_and_as_its_sigma_says(noise):
    """Without it neighbours err alike, so that larger blocks err as much."""
    chosen = dic.tile_prefilter(seen(blots(3)), SIZE, noise)
    assert chosen.sigma > 0
    plain, _ = errors(noise, 0.0, 3)
    smooth, over = errors(noise, chosen, 3)
    assert smooth.std() < 0.5 * plain.std()
    assert np.abs(smooth.mean(axis=(0, 1))).max() < 0.5e-3
    assert 0.9 < np.sqrt(np.mean(over**2)) < 1.15


def test_a_lone_tile_of_a_hard_print_errs_by_its_rim_as_well():
    plain, _ = errors(2.0, 0.0, 1)
    smooth, over = errors(2.0, 0.8, 1)
    assert smooth.std() < 0.7 * plain.std()
    assert 1.0 < np.sqrt(np.mean(over**2)) < 1.4


def test_a_soft_print_passes_no_filter_and_its_sums_are_those_of_before():
    image = seen(blots(3, 9.0))
    chosen = dic.tile_prefilter(image, SIZE, 2.0)
    assert chosen.sigma == 0
    plain, same = dic.prepare_tiles(image, SIZE), dic.prepare_tiles(image, SIZE, chosen)
    assert same.smooth is None
    assert same.motion_noise(2.0) == 2.0
    sums = [dic.tile_sums(each, image + 1.0) for each in (plain, same)]
    np.testing.assert_array_equal(sums[0].gradient, sums[1].gradient)


def test_tiles_beside_the_pattern_say_nothing_of_its_aliasing():
    image = seen(blots(3))
    beside = np.concatenate([image, np.full((image.shape[0], 3 * image.shape[1]), 128.0)], axis=1)
    whole, part = dic.prepare_tiles(image, SIZE), dic.prepare_tiles(beside, SIZE)
    counted = part.tiles.xs < image.shape[1] - SIZE
    on = np.tile(counted, part.tiles.shape[0])
    assert part.motion_noise(1.0) == 1.0
    assert part.motion_noise(1.0, on) == pytest.approx(whole.motion_noise(1.0), rel=0.25)
    assert whole.motion_noise(1.0) > 1.2


def test_noise_of_a_frame_is_what_the_hessian_says_and_tiles_stay_independent():
    image, rng = seen(blots(4)), np.random.default_rng(6)
    reference = dic.prepare_tiles(image, SIZE, 0.8)
    flow = np.zeros((len(reference.hessian), 2))
    shown = np.array(
        [
            dic.tile_sums(reference, image + rng.normal(0.0, 2.0, SHAPE), flow).gradient
            for _ in range(200)
        ]
    )
    variance = 4.0 * reference.hessian[:, [0, 2]]
    assert np.mean(shown**2 / variance[None]) == pytest.approx(1.0, abs=0.03)
    white = (shown / np.sqrt(variance)).reshape(200, *reference.tiles.shape, 2)
    assert abs(np.mean(white[:, :, 1:] * white[:, :, :-1])) < 0.02
    assert abs(np.mean(white[:, 1:] * white[:, :-1])) < 0.02


def test_a_filtered_gradient_reads_what_both_filtered_images_would():
    ink, prefilter = blots(5), dic.Prefilter(0.8)
    rest, frame, flow = seen(ink), seen(ink, (2, 3)), np.array([0.25, 0.375])
    once = motion(dic.prepare_tiles(rest, SIZE, prefilter), frame, flow, 3)
    both = motion(dic.prepare_tiles(prefilter.apply(rest), SIZE), prefilter.apply(frame), flow, 3)
    plain = motion(dic.prepare_tiles(rest, SIZE), frame, flow, 3)
    assert np.std(once - both) < 0.25 * np.std(plain)
    assert np.std(once) < 1.2 * np.std(both)


def test_sums_in_place_are_those_of_a_reference_moved_by_nothing():
    ink = blots(6)
    reference = dic.prepare_tiles(seen(ink), SIZE, 1.0)
    frame, flow = seen(ink, (1, 0)), np.zeros((len(reference.hessian), 2))
    still, moved = dic.tile_sums(reference, frame), dic.tile_sums(reference, frame, flow)
    np.testing.assert_allclose(still.gradient, moved.gradient, rtol=1e-3, atol=1.0)
    np.testing.assert_allclose(still.hessian, moved.hessian, rtol=1e-4, atol=1.0)
    np.testing.assert_allclose(still.light, moved.light, rtol=1e-3, atol=10.0)


def test_a_tile_without_a_pattern_stays_finite():
    image = seen(blots(7))
    image[:64, :64] = 90.0
    reference = dic.prepare_tiles(image, SIZE, 0.8)
    sums = dic.tile_sums(reference, image + 1.0, np.full((len(reference.hessian), 2), 0.3))
    assert all(np.isfinite(each).all() for each in (sums.gradient, sums.hessian, sums.light))


def test_an_image_too_small_for_a_spectrum_passes_no_filter():
    assert dic.tile_prefilter(np.eye(12), 4, 1.0).sigma == 0


def test_what_is_no_filter_no_noise_or_no_pattern_is_refused():
    image = seen(blots(8))
    with pytest.raises(ValueError, match=r"prefilter must be from 0 to 5 px, got 9 px"):
        dic.prepare_tiles(image, SIZE, 9.0)
    with pytest.raises(ValueError, match=r"noise .*grey levels.*nan"):
        dic.tile_prefilter(image, SIZE, float("nan"))
    with pytest.raises(ValueError, match=r"tile size must be 4 px or more, got 0 px"):
        dic.tile_prefilter(image, 0, 1.0)
    with pytest.raises(ValueError, match="blank"):
        dic.tile_prefilter(np.full(SHAPE, 7.0), SIZE, 1.0)

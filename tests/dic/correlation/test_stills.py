"""A reference of several stills: less noise, and a σ that holds where noise is not white."""

import numpy as np
import pytest
from scipy import ndimage

import dic

COUNT = 9
SHIFT = (0.3, -0.2)


def white(rng, shape):
    return rng.normal(0, 3.0, shape)


def grainy(rng, shape):
    """Noise that neighbours have in common, as a demosaiced colour camera has."""
    return ndimage.gaussian_filter(white(rng, shape), 1.2) * 3.0


def photographed(pattern, noise, seed):
    rng = np.random.default_rng(seed)
    plain, moved = pattern.draw(), pattern.draw(SHIFT)
    stills = [plain + noise(rng, plain.shape) for _ in range(COUNT)]
    frames = [moved + noise(rng, plain.shape) for _ in range(4)]
    return stills, frames


def errors(reference, frames):
    """Errors px of u and v, and these over σ."""
    fields = [dic.correlate(reference, frame) for frame in frames]
    off = np.concatenate([np.column_stack([f.u, f.v])[f.valid] - SHIFT for f in fields])
    sigma = np.concatenate([np.column_stack([f.sigma_u, f.sigma_v])[f.valid] for f in fields])
    return off, off / sigma


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def test_the_mean_of_stills_has_less_noise_and_its_sigma_says_so(pattern):
    stills, frames = photographed(pattern, white, 5)
    several = errors(dic.prepare_stills(stills, prefilter=0), frames)
    single = errors(dic.prepare(stills[0], prefilter=0), frames)
    assert rms(several[0]) / rms(single[0]) == pytest.approx(np.sqrt((1 + 1 / COUNT) / 2), rel=0.1)
    assert rms(several[1]) == pytest.approx(1.0, abs=0.12)


def test_noise_that_is_not_white_is_sampled(pattern):
    stills, frames = photographed(pattern, grainy, 6)
    reference = dic.prepare_stills(stills, prefilter=0)
    assert rms(errors(reference, frames)[1]) == pytest.approx(1.0, abs=0.2)
    assert (reference.scatter >= 1.0).all()


def test_a_camera_that_trembles_between_stills_widens_nothing(pattern):
    rng = np.random.default_rng(7)
    shifts = rng.normal(0, 0.01, (COUNT, 2))
    stills = [pattern.draw(tuple(s)) + white(rng, (150, 190)) for s in shifts]
    assert dic.prepare_stills(stills, prefilter=0).scatter.max() < 1.1


def test_expected_sigma_is_that_of_the_frames(pattern):
    stills, frames = photographed(pattern, white, 8)
    reference = dic.prepare_stills(stills)
    field = dic.correlate(reference, frames[0])
    expected = dic.expected_sigma(reference, 3.0)[field.valid]
    assert np.median(expected[:, 0] / field.sigma_u[field.valid]) == pytest.approx(1.0, abs=0.12)


def test_the_prefilter_is_chosen_by_the_noise_between_stills(pattern):
    stills, _ = photographed(pattern, white, 9)
    noise = dic.prepare_stills(stills).prefilter.noise
    assert noise == pytest.approx(3.0, rel=0.1)


def test_one_image_and_images_of_two_sizes_are_refused(reference):
    with pytest.raises(ValueError, match="2 images or more"):
        dic.prepare_stills([reference])
    with pytest.raises(ValueError, match="still 2 is 190x147 px and the first 190x150 px"):
        dic.prepare_stills([reference, reference[:-3]])


def test_a_still_that_has_moved_is_named(pattern):
    stills, _ = photographed(pattern, white, 10)
    with pytest.raises(ValueError, match="still 4 lies"):
        dic.prepare_stills([*stills[:3], pattern.draw((3.0, 0.0)), *stills[3:]])


def test_stills_that_clip_are_known_to(pattern):
    rng, lamp = np.random.default_rng(11), np.where(np.arange(190) < 90, 300.0, 0.0)
    plain = pattern.draw() + lamp
    stills = [
        np.clip(np.rint(plain + white(rng, plain.shape)), 0, 255).astype(np.uint8) for _ in range(4)
    ]
    single, several = dic.prepare(stills[0]), dic.prepare_stills(stills)
    saturated = single.status == dic.Status.SATURATED
    assert saturated.any()
    np.testing.assert_array_equal(several.status == dic.Status.SATURATED, saturated)


def test_a_renewed_reference_keeps_what_stills_have_shown(pattern):
    stills, frames = photographed(pattern, grainy, 12)
    reference = dic.prepare_stills(stills)
    start = dic.correlate(reference, frames[0])
    renewed = dic.renewed_reference(reference, start, frames[0])
    np.testing.assert_array_equal(renewed.scatter, reference.scatter)
    assert renewed.prefilter.noise == reference.prefilter.noise
    assert renewed.stills == 1

"""Fields whose window the data choose, on speckle whose motion is known in closed form."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

import dic

SHAPE = (200, 240)
NOISE = 2.0
SHIFT, GRADIENT = (0.4, -0.7), ((0.004, 0.002), (-0.003, 0.001))


def noisy(image, seed):
    return image + np.random.default_rng(seed).normal(0, NOISE, image.shape)


def errors(field, truth):
    return np.column_stack([field.u, field.v]) - truth


@pytest.fixture(scope="module")
def stretched(speckle):
    drawn = speckle(SHAPE)
    frames = [noisy(drawn.draw(SHIFT, GRADIENT), 10 + k) for k in range(6)]
    references = [noisy(drawn.draw(), 30 + k) for k in range(6)]
    fields = [
        dic.adaptive_field(dic.prepare(a), b) for a, b in zip(references, frames, strict=True)
    ]
    truth = drawn.displacement(fields[0].xy, SHIFT, GRADIENT)
    return fields, truth


def test_an_even_strain_has_a_fifth_of_the_noise_of_a_subset(stretched):
    fields, truth = stretched
    off = np.stack([errors(field, truth) for field in fields])
    assert np.abs(off.mean(axis=(0, 1))).max() < 1e-3  # px, bias
    assert np.sqrt(np.mean(off**2)) < 2.5e-3  # px; a subset of 21 has 8e-3
    assert all(field.valid.mean() > 0.99 for field in fields)


def test_its_sigma_is_that_of_its_error(stretched):
    fields, truth = stretched
    off = np.stack([errors(field, truth) for field in fields])
    power = [np.square(field.sigma_u) + np.square(field.sigma_v) for field in fields]
    stated = np.sqrt(np.mean(power))
    assert 0.6 < np.sqrt(np.mean(np.sum(off**2, axis=-1))) / stated < 1.5


def test_noise_that_a_prefilter_has_correlated_is_counted(speckle):
    drawn = speckle(SHAPE)
    ref = dic.prepare(noisy(drawn.draw(), 21), prefilter=0.8)
    found = dic.adaptive_field(ref, noisy(drawn.draw(SHIFT), 22))
    off = errors(found, SHIFT)
    stated = np.sqrt(np.mean(found.sigma_u**2 + found.sigma_v**2))
    assert np.sqrt(np.mean(off**2)) < 4e-3  # px
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 1.8 * stated


def test_strain_takes_it_with_its_own_gauge(stretched):
    fields, _ = stretched
    eps = dic.strain(fields[0], kind="small")
    assert eps.window == 1
    assert eps.vsg > 60
    assert np.sqrt(np.mean((eps.exx - GRADIENT[0][0]) ** 2)) < 1e-4
    assert np.sqrt(np.mean((eps.exy - (GRADIENT[0][1] + GRADIENT[1][0]) / 2) ** 2)) < 1e-4
    assert np.all(eps.sigma > 0)


def moved(image, displacement):
    """Image whose material has moved by (u, v) of the reference, found by iteration."""
    y, x = np.indices(image.shape).astype(float)
    at_x, at_y = x.copy(), y.copy()
    for _ in range(40):
        u, v = displacement(at_x, at_y)
        at_x, at_y = x - u, y - v
    return map_coordinates(image, [at_y, at_x], order=5, mode="reflect")


def test_a_short_wave_that_a_subset_flattens_comes_back(speckle):
    image = speckle(SHAPE).draw()

    def wave(x, y):
        return 0 * x, 0.3 * np.cos(2 * np.pi * (y - 0.3 * x) / 30)

    ref = dic.prepare(noisy(image, 1))
    frame = noisy(moved(image, wave), 2)
    by_subsets, found = dic.correlate(ref, frame), dic.adaptive_field(ref, frame)
    inside = np.all((found.xy > 25) & (found.xy < np.array(SHAPE[::-1]) - 25), axis=1)
    truth = np.column_stack(wave(*found.xy.T))
    off, before = (np.sqrt(np.mean(errors(f, truth)[inside] ** 2)) for f in (found, by_subsets))
    assert off < 0.025
    assert off < 0.25 * before


def test_a_wave_of_four_tiles_keeps_its_height(speckle):
    """A tile that did not bend with the wave would see 9/10 of it."""
    image = speckle(SHAPE).draw()

    def wave(x, y):
        return 0 * x, 0.3 * np.cos(2 * np.pi * y / 20)

    found = dic.adaptive_field(dic.prepare(noisy(image, 1)), noisy(moved(image, wave), 2))
    inside = np.all((found.xy > 25) & (found.xy < np.array(SHAPE[::-1]) - 25), axis=1)
    truth = wave(*found.xy[inside].T)[1]
    assert found.v[inside] @ truth / (truth @ truth) > 0.96


def test_a_steep_wave_tears_no_tile_at_the_border(speckle):
    image = speckle(SHAPE).draw()

    def star(x, y):
        return 0 * x, 0.5 * np.cos(2 * np.pi * (y - 250) / (26 + 0.0725 * x))

    ref, frame = dic.prepare(noisy(image, 7)), noisy(moved(image, star), 8)
    found = dic.adaptive_field(ref, frame)
    off = np.abs(errors(found, np.column_stack(star(*found.xy.T))))[found.valid]
    assert found.valid.mean() > 0.99
    assert np.quantile(off, 0.995) < 0.1


def cracked(image, jump):
    """Image whose right half has moved down by `jump` px, along the column 120."""
    slid = map_coordinates(image, np.indices(image.shape) - [[[jump]], [[0.0]]], order=5)
    return np.where(np.arange(image.shape[1]) < 119.5, image, slid)


def test_it_does_not_smear_across_a_crack(speckle):
    image = speckle(SHAPE).draw()
    found = dic.adaptive_field(dic.prepare(noisy(image, 3)), noisy(cracked(image, 1.0), 4))
    away = found.xy[:, 0] - 119.5
    near = (np.abs(away) > 5) & (np.abs(away) < 20) & (np.abs(found.xy[:, 1] - 100) < 75)
    off = np.abs(found.v - (away > 0))[near]
    assert np.nanmax(off) < 0.06
    assert np.isfinite(off).mean() > 0.95
    torn = found.status == dic.Status.BROKEN
    assert torn.any()
    assert np.abs(away[torn]).max() < 10


def test_nothing_is_carried_into_or_out_of_a_hole(speckle):
    drawn = speckle(SHAPE)
    image, frame = noisy(drawn.draw(), 5), noisy(drawn.draw(SHIFT, GRADIENT), 6)
    y, x = np.indices(SHAPE)
    away = np.hypot(x - 120, y - 100)
    frame[away < 30] = 20.0  # what moves there is no pattern
    image[away < 30] = 20.0
    found = dic.adaptive_field(dic.prepare(image, roi=away > 32), frame)
    off = errors(found, drawn.displacement(found.xy, SHIFT, GRADIENT))
    within = np.hypot(found.xy[:, 0] - 120, found.xy[:, 1] - 100) < 30
    assert np.isnan(off[within]).all()
    assert (found.status[within] == dic.Status.EXCLUDED).all()
    stated = np.column_stack([found.sigma_u, found.sigma_v])
    assert np.nanmax(np.abs(off / stated)[~within]) < 6
    rim = ~within & (np.hypot(found.xy[:, 0] - 120, found.xy[:, 1] - 100) > 40)
    assert np.nanmax(np.abs(off[rim])) < 0.012


def test_a_hole_that_no_roi_leaves_out_is_flat_and_holds_nothing_beside_it(speckle):
    drawn = speckle(SHAPE)
    y, x = np.indices(SHAPE)
    hole = np.hypot(x - 120, y - 100) < 35
    scaled: list[np.ndarray] = []
    for seed in range(4):
        image = drawn.draw()
        image[hole] = 20.0
        frame = np.roll(image, (2, -3), (0, 1))
        found = dic.adaptive_field(dic.prepare(noisy(image, 40 + seed)), noisy(frame, 50 + seed))
        away = np.hypot(found.xy[:, 0] - 120, found.xy[:, 1] - 100)
        assert not found.valid[away < 25].any()
        assert (found.status[away < 20] == dic.Status.FLAT).all()
        off = errors(found, (-3.0, 2.0)) / np.column_stack([found.sigma_u, found.sigma_v])
        scaled.append(off[found.valid & (away < 60)])
    assert np.sqrt(np.mean(np.square(np.concatenate(scaled)))) < 1.5


def test_a_hand_over_the_pattern_is_left_out_and_the_rest_is_not_touched(speckle):
    drawn = speckle(SHAPE)
    frame = noisy(drawn.draw(SHIFT), 7)
    frame[60:140, 150:] = 70.0
    found = dic.adaptive_field(dic.prepare(noisy(drawn.draw(), 8)), frame)
    behind = (found.xy[:, 0] > 162) & (np.abs(found.xy[:, 1] - 100) < 28)
    assert not found.valid[behind].any()
    clear = found.xy[:, 0] < 138
    assert np.sqrt(np.nanmean(errors(found, SHIFT)[clear] ** 2)) < 4e-3
    assert found.valid[clear].all()


def test_a_masked_half_does_not_change_the_other_and_what_is_no_number_is_refused(speckle):
    drawn, roi = speckle(SHAPE), np.ones(SHAPE, bool)
    roi[:, 120:] = False
    first, second = noisy(drawn.draw(), 41), noisy(drawn.draw(SHIFT, GRADIENT), 42)
    whole = dic.adaptive_field(dic.prepare(first), second)
    half = dic.adaptive_field(dic.prepare(first, roi=roi), second)
    assert not half.valid[half.xy[:, 0] > 125].any()
    known = half.valid & (half.xy[:, 0] < 100)
    assert known.sum() > 0.9 * np.sum(half.xy[:, 0] < 100)
    truth = drawn.displacement(half.xy, SHIFT, GRADIENT)
    ours, theirs = (np.sqrt(np.mean(errors(f, truth)[known] ** 2)) for f in (half, whole))
    assert ours < 1.5 * theirs
    with pytest.raises(ValueError, match="deformed image"):
        dic.adaptive_field(dic.prepare(first), np.where(second > 200, np.nan, second))


def test_points_anywhere_are_those_of_the_grid_between_its_points(speckle):
    drawn = speckle(SHAPE)
    image, frame = noisy(drawn.draw(), 9), noisy(drawn.draw(SHIFT, GRADIENT), 10)
    places = np.random.default_rng(1).uniform(30, 170, (40, 2))
    found = dic.adaptive_field(dic.prepare(image, points=places), frame)
    off = errors(found, drawn.displacement(places, SHIFT, GRADIENT))
    assert found.valid.all()
    assert np.sqrt(np.mean(off**2)) < 3e-3
    coarse = dic.adaptive_field(dic.prepare(image, subset=31, step=17), frame)
    off = errors(coarse, drawn.displacement(coarse.xy, SHIFT, GRADIENT))
    assert np.sqrt(np.nanmean(off**2)) < 3e-3


def test_a_field_too_small_for_a_block_is_that_of_its_subsets(speckle):
    drawn = speckle((36, 60))
    ref, frame = dic.prepare(noisy(drawn.draw(), 11), 15), noisy(drawn.draw(SHIFT), 12)
    plain, found = dic.correlate(ref, frame), dic.adaptive_field(ref, frame)
    assert np.array_equal(plain.u, found.u, equal_nan=True)
    assert found.gauge is not None
    assert (found.gauge == 15).all()
    assert dic.adaptive_tiles(ref, frame, plain) is None


def test_an_island_too_small_for_a_block_is_that_of_its_subsets(speckle):
    drawn = speckle(SHAPE)
    roi = np.zeros(SHAPE, bool)
    roi[80:98, 100:118] = True
    ref = dic.prepare(noisy(drawn.draw(), 13), 15, roi=roi)
    frame = noisy(drawn.draw(SHIFT), 14)
    plain, found = dic.correlate(ref, frame), dic.adaptive_field(ref, frame)
    known = plain.valid
    assert known.any()
    assert np.array_equal(found.u, plain.u, equal_nan=True)
    assert found.gauge is not None
    assert (found.gauge[known] == 15).all()


def test_an_image_without_noise_and_a_frame_without_pattern_are_no_error(speckle):
    image = speckle(SHAPE).draw()
    ref = dic.prepare(image)
    same = dic.adaptive_field(ref, image)
    assert np.nanmax(np.abs(same.u)) < 1e-3
    other = dic.adaptive_field(ref, np.random.default_rng(0).normal(128, 50, SHAPE))
    assert not other.valid.any()

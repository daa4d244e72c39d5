"""What blocks make of drawn tiles: truth plus white noise, without images."""

import numpy as np
import pytest

import dic
from dic.adaptive.evaluation import evaluate
from dic.adaptive.tile_lattice import TILE

SHAPE = (48, 60)
SIGMA = 0.03  # px


def drawn(values, seed, valid=None):
    rng = np.random.default_rng(seed)
    seen = np.stack([values, -values]) + rng.normal(0, SIGMA, (2, *values.shape))
    known = np.ones(values.shape, bool) if valid is None else valid
    return dic.denoised_tiles(seen, np.full_like(seen, SIGMA), known)


def places():
    y, x = np.indices(SHAPE).astype(float)
    return x, y


FIELDS = {
    "nothing": lambda x, y: 0 * x,
    "a wave": lambda x, y: 0.4 * np.cos(2 * np.pi * (x + 0.4 * y) / 9),
    "a bend": lambda x, y: 1e-3 * (x - 30) ** 2 - 5e-4 * x * y,
    "a bump": lambda x, y: 0.5 * np.exp(-((x - 25) ** 2 + (y - 20) ** 2) / 50),
}


@pytest.mark.parametrize("name", FIELDS)
def test_the_error_is_as_stated_for_values_and_slopes(name):
    x, y = places()
    truth = FIELDS[name](x, y)
    slope = (FIELDS[name](x + 1e-4, y) - FIELDS[name](x - 1e-4, y)) / 2e-4
    tiles = [drawn(truth, seed) for seed in range(6)]
    for k, true in ((0, truth), (1, slope)):
        off = np.sqrt(np.mean([np.square(t.values[0, k] - true) for t in tiles]))
        stated = np.sqrt(np.mean([np.square(t.sigma[0, k]) for t in tiles]))
        assert 0.5 < off / stated < 1.6
    bias = np.mean([t.values[0, 0] - truth for t in tiles], axis=0)
    assert np.abs(bias).mean() < 0.6 * SIGMA


def test_large_windows_are_chosen_where_the_field_is_even():
    x, y = places()
    even, wavy = (drawn(FIELDS[name](x, y), 1) for name in ("nothing", "a wave"))
    assert np.median(even.sigma[0, 0]) < 0.4 * np.median(wavy.sigma[0, 0])
    assert np.median(even.sigma[0, 0]) < 0.1 * SIGMA


def test_where_nothing_bends_blocks_are_wider_still():
    wide, off, stated = (96, 108), [], []
    for seed in range(6):
        tiles = drawn(np.zeros(wide), seed)
        off.append(tiles.values[0, 0, 8:-8, 8:-8])
        stated.append(tiles.sigma[0, 0, 8:-8, 8:-8])
    scatter = np.sqrt(np.mean(np.square(off)))
    assert scatter < 0.033 * SIGMA  # 0.041 with blocks of 32 tiles and less
    assert np.sqrt(np.mean(np.square(stated))) == pytest.approx(scatter, rel=0.2)


def test_wide_blocks_flatten_no_bump():
    y, x = np.indices((96, 108)).astype(float)
    bump = 0.5 * np.exp(-((x - 60) ** 2 + (y - 40) ** 2) / 200)
    off = [drawn(bump, seed).values[0, 0] - bump for seed in range(6)]
    around = bump > 0.05
    assert np.abs(np.mean(off, axis=0))[around].max() < 0.5 * SIGMA
    assert np.sqrt(np.mean(np.square(off), axis=0))[around].mean() < 0.2 * SIGMA


def test_half_of_a_field_may_be_masked():
    x, y = places()
    truth, valid = FIELDS["a bend"](x, y), x + 0.3 * y < 35
    tiles = drawn(truth, 2, valid)
    assert np.array_equal(np.isfinite(tiles.values[0, 0]), valid)
    assert np.sqrt(np.nanmean((tiles.values[0, 0] - truth) ** 2)) < 0.4 * SIGMA


def test_sides_that_a_crack_parts_know_nothing_of_each_other():
    x, y = places()
    torn = np.abs(x + 0.5 * y - 40) <= 0.75
    beyond = x + 0.5 * y > 40
    one, other = drawn(0 * x, 3, ~torn), drawn(5.0 * beyond, 3, ~torn)
    same = ~torn
    off = other.values[0, 0] - 5.0 * beyond - one.values[0, 0]
    assert np.abs(off[same]).max() < 0.35 * SIGMA


def test_a_tile_that_is_not_known_is_left_out():
    x, _ = places()
    seen = np.zeros((2, *SHAPE))
    seen[0, 7, 8] = np.nan
    tiles = dic.denoised_tiles(seen, np.full_like(seen, SIGMA), np.ones(SHAPE, bool))
    assert np.isnan(tiles.values[0, 0, 7, 8])
    assert np.isfinite(tiles.values).sum() > 0
    nothing = dic.denoised_tiles(seen * np.nan, seen + SIGMA, np.ones_like(x, bool))
    assert np.isnan(nothing.values).all()


def test_noise_must_be_positive():
    seen = np.zeros((2, *SHAPE))
    with pytest.raises(ValueError, match="noise must be above 0 px"):
        dic.denoised_tiles(seen, seen, np.ones(SHAPE, bool))


@pytest.mark.parametrize("beside", [-0.4, -0.1, 0.0, 0.3])
def test_beside_a_tile_without_value_the_nearest_one_is_carried_on(beside):
    x, y = places()
    tiles = drawn(0.2 * x - 0.1 * y, 3)
    tiles.values[..., 1] = np.nan
    place = np.array(tiles.lattice.origin) + TILE * np.array([[beside, 4.0]])
    found = evaluate(tiles, place)
    value, along = tiles.values[0, :2, 4, 0]
    assert found.values[0, 0, 0] == pytest.approx(value + along * beside, abs=1e-12)
    assert found.sigma[0, 0, 0] == pytest.approx(tiles.sigma[0, 0, 4, 0])


@pytest.mark.parametrize(("size", "grows"), [(0.5, True), (0.0, False)])
def test_sigma_of_slopes_grows_where_the_field_bends_and_not_where_nothing_does(size, grows):
    """Stated over error of slopes around a bump, rms of four draws; with and without the factor."""
    x, y = places()
    bump = size * np.exp(-((x - 45) ** 2 + (y - 30) ** 2) / 72)
    slopes = np.stack([-(x - 45) / 36 * bump, -(y - 30) / 36 * bump])
    near = np.hypot(x - 45, y - 30) < 15
    tiles = [drawn(bump, (21, seed)) for seed in range(4)]
    error = rms([(one.values[0, 1:] - slopes)[:, near] for one in tiles])
    assert 0.85 < rms([one.stated_sigma[0, 1:, near] for one in tiles]) / error < 1.2
    factor = np.array([one.slope_factor[near] for one in tiles])
    assert (factor.mean() > 1.2) == grows
    assert (factor.mean() < 1.02) != grows
    for one in tiles:
        np.testing.assert_array_equal(one.stated_sigma[:, 0], one.sigma[:, 0])


def rms(values):
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))

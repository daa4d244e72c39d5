"""Displacement from tile sums: exact renderings found again, with the σ that sampling finds."""

import numpy as np
import pytest

import dic
from dic.tiles.tile_field import MIN_ZNCC, tile_gradient
from dic.tiles.tiles import tile_sums

SIZE = 8


@pytest.fixture(scope="module")
def blocks(reference):
    return dic.prepare_blocks(dic.prepare_tiles(reference, SIZE), 3)


def follow(blocks, frame, passes=3, noise=1.0, start=(0.0, 0.0)):
    """Displacement of a frame, each pass at the flow of the one before."""
    flow = np.zeros_like(blocks.reference.tiles.xy) + start
    for _ in range(passes):
        field = dic.tile_displacement(blocks, tile_sums(blocks.reference, frame, flow), noise)
        flow = np.nan_to_num(np.column_stack([field.u, field.v]))
    return field


def test_a_shift_is_found(blocks, pattern):
    field = follow(blocks, pattern.draw((0.37, -0.62)))
    assert field.valid.all()
    error = np.column_stack([field.u - 0.37, field.v + 0.62])
    assert np.abs(error.mean(axis=0)).max() < 3e-4  # px
    assert error.std() < 1e-3  # px


def test_a_field_is_that_of_the_material_points(blocks, pattern):
    shift, gradient = (0.2, 0.1), ((1e-3, 3e-4), (-6e-4, -1.2e-3))
    field = follow(blocks, pattern.draw(shift, gradient))
    error = np.column_stack([field.u, field.v]) - pattern.displacement(field.xy, shift, gradient)
    inner = np.abs(field.xy - pattern.middle).max(axis=1) < 50
    assert np.abs(error[inner].mean(axis=0)).max() < 1e-3  # px
    assert error[inner].std() < 3e-3  # px, gradients within a block


def test_a_large_motion_is_that_of_the_material_points_too(blocks, pattern):
    shift, gradient = (2.6, -1.9), ((6e-3, 2e-3), (-3e-3, -5e-3))
    field = follow(blocks, pattern.draw(shift, gradient), start=shift)
    error = np.column_stack([field.u, field.v]) - pattern.displacement(field.xy, shift, gradient)
    inner = np.abs(field.xy - pattern.middle).max(axis=1) < 50
    # What the frame shows at a tile and what was there differ by ∇d·d, 12 and 18 mpx.
    assert np.abs(error[inner].mean(axis=0)).max() < 2e-3  # px


@pytest.mark.parametrize(("gain", "offset"), [(1.2, -15.0), (0.8, 0.0), (1.0, 20.0)])
def test_gain_and_offset_of_the_light_do_not_matter(blocks, pattern, gain, offset):
    frame = pattern.draw((0.3, 0.4))
    plain, lit = follow(blocks, frame), follow(blocks, gain * frame + offset, passes=6)
    np.testing.assert_allclose(lit.u, plain.u, atol=1e-3)
    np.testing.assert_allclose(lit.v, plain.v, atol=1e-3)
    np.testing.assert_allclose(lit.zncc, plain.zncc, atol=1e-4)


def test_sigma_is_the_scatter_of_a_few_frames(blocks, pattern):
    rng, noise, shift = np.random.default_rng(6), 2.0, (0.3, -0.2)
    frame, flow = pattern.draw(shift), np.tile(shift, (len(blocks.status), 1))
    noisy = [frame + rng.normal(0, noise, frame.shape) for _ in range(12)]
    fields = [
        dic.tile_displacement(blocks, tile_sums(blocks.reference, each, flow), noise)
        for each in noisy
    ]
    scatter = np.std([[field.u, field.v] for field in fields], axis=0, ddof=1)
    stated = np.array([fields[0].sigma_u, fields[0].sigma_v])
    assert np.sqrt(np.mean((scatter / stated) ** 2, axis=1)) == pytest.approx([1, 1], abs=0.15)


@pytest.mark.slow
def test_sigma_is_what_sampling_finds(blocks, pattern):
    rng, noise = np.random.default_rng(5), 2.0
    shift = (0.3, -0.2)
    frame, flow = pattern.draw(shift), np.tile(shift, (len(blocks.status), 1))
    samples, sides = [], []
    for _ in range(300):
        sums = tile_sums(blocks.reference, frame + rng.normal(0, noise, frame.shape), flow)
        field = dic.tile_displacement(blocks, sums, noise)
        samples.append([field.u, field.v])
        sides.append(tile_gradient(blocks, sums))
    predicted = np.array([field.sigma_u, field.sigma_v])
    ratio = np.std(samples, axis=0, ddof=1) / predicted
    assert np.sqrt((ratio**2).mean(axis=1)) == pytest.approx([1.0, 1.0], abs=0.03)
    assert np.quantile(ratio, [0.01, 0.99]) == pytest.approx([0.9, 1.1], abs=0.05)
    scatter = np.std(sides, axis=0, ddof=1) / noise
    stated = np.sqrt(blocks.hessian[:, [0, 1], [0, 1]])
    assert np.sqrt(np.mean((scatter / stated) ** 2)) == pytest.approx(1.0, abs=0.03)


def test_zncc_is_that_of_numpy(blocks, reference, pattern):
    frame = pattern.draw((0.4, 0.2)) + np.random.default_rng(2).normal(0, 20, reference.shape)
    field = dic.tile_displacement(blocks, tile_sums(blocks.reference, frame), 20.0)
    index = 5 * blocks.reference.tiles.shape[1] + 9  # not at the border
    half = 3 * SIZE / 2
    x, y = (field.xy[index] - half + 0.5).astype(int)
    window = slice(y, y + 3 * SIZE), slice(x, x + 3 * SIZE)
    truth = np.corrcoef(reference[window].ravel(), frame[window].ravel())[0, 1]
    assert field.zncc[index] == pytest.approx(truth, abs=1e-4)


def test_blank_parts_are_flat_and_covered_parts_are_lost(reference, pattern):
    blank = reference.copy()
    blank[:60, :70] = 128.0
    blocks = dic.prepare_blocks(dic.prepare_tiles(blank, SIZE), 3)
    frame = np.where(np.arange(190) > 130, 60.0, blank)  # a hand over the right of the frame
    field = dic.tile_displacement(blocks, tile_sums(blocks.reference, frame), 1.0)
    x, y = field.xy.T
    reach = 1.5 * SIZE
    flat = (x + reach < 70) & (y + reach < 60)
    covered = x - reach > 131
    seen = (x + reach < 130) & ((x - reach > 72) | (y - reach > 62))
    assert (field.status[flat] == dic.Status.FLAT).all()
    assert (field.status[covered] == dic.Status.LOW_CORRELATION).all()
    assert field.valid[seen].all()
    assert (field.zncc[seen] > MIN_ZNCC).all()
    for values in (field.u, field.v, field.sigma_u, field.sigma_v):
        assert np.isfinite(values[field.valid]).all()
        assert np.isnan(values[~field.valid]).all()


@pytest.mark.parametrize("level", [128.0, 255.0])
def test_an_image_without_pattern_under_its_tiles_is_flat_everywhere(level):
    image = np.full((60, 90), level)
    image[0, 0] += 1e-3
    blocks = dic.prepare_blocks(dic.prepare_tiles(image, SIZE))
    assert (blocks.status == dic.Status.FLAT).all()
    field = dic.tile_displacement(blocks, tile_sums(blocks.reference, np.zeros((60, 90))), 1.0)
    assert not field.valid.any()


def test_points_are_the_tile_centres_and_a_block_is_the_subset(blocks, reference):
    field = follow(blocks, reference, passes=1)
    assert field.grid is not None
    assert field.grid.shape == blocks.reference.tiles.shape
    np.testing.assert_array_equal(field.grid.xy, field.xy)
    assert (field.subset, field.order, field.grid.step) == (3 * SIZE, 0, SIZE)
    np.testing.assert_allclose(field.u, 0.0, atol=1e-6)


@pytest.mark.parametrize(("block", "use"), [(4, 5), (0, 1), (-2, 1)])
def test_an_even_block_is_refused(reference, block, use):
    prepared = dic.prepare_tiles(reference, SIZE)
    with pytest.raises(ValueError, match=f"^block must be an odd number .* {block}; use {use}$"):
        dic.prepare_blocks(prepared, block)

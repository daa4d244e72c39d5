"""The sums of a frame without the light of each tile, as the loop takes them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from dic import prepare_blocks, prepare_tiles, tile_gradient, tile_sums, unbiased_gradient
from models import fit_tiles
from rig.live.illumination import (
    contrast_loss,
    sums_without_gain_offset,
    variance_by_contrast,
    without_gain_offset,
)


def test_what_interpolation_adds_is_taken_off_once():
    image = 128 + 200 * gaussian_filter(np.random.default_rng(4).normal(size=(80, 112)), 1.2)
    reference = replace(prepare_tiles(image, 16), bias=np.array([4e-3, 3e-3]))
    blocks = prepare_blocks(reference, 1)
    sums = tile_sums(reference, image, np.tile([0.25, 0.2], (len(reference.hessian), 1)))
    weight = np.linspace(0.5, 2.0, len(reference.hessian))
    contrast = fit_tiles(reference, sums).contrast
    moving = sums_without_gain_offset(blocks, sums, weight, contrast)
    seen = unbiased_gradient(without_gain_offset(blocks, weight), moving)
    scale = weight / contrast
    np.testing.assert_array_equal(seen, -tile_gradient(blocks, sums) * scale[:, None])
    taken_off = sums.gradient - unbiased_gradient(reference, sums)
    assert np.abs(taken_off).min() > 0


def image_in_a_gradient_of_light():
    """Return a reference, and its image at 0.05 px, the light of which falls along x to 0.55."""
    rng = np.random.default_rng(6)
    image = 128 + 200 * gaussian_filter(rng.normal(size=(80, 112)), 1.5)
    light = np.linspace(1.0, 0.55, 112)
    return prepare_tiles(image, 16), light * np.roll(image, 1, axis=0)


def test_a_tile_in_the_shade_says_as_much_of_a_motion_as_one_in_the_light():
    reference, image = image_in_a_gradient_of_light()
    blocks, count = prepare_blocks(reference, 1), len(reference.hessian)
    sums = tile_sums(reference, image, np.tile([0.0, 0.95], (count, 1)))
    contrast = fit_tiles(reference, sums).contrast
    moving = sums_without_gain_offset(blocks, sums, np.ones(count), contrast)
    left = np.einsum("tij,tj->ti", blocks.inverse, moving.gradient)[:, 1]
    columns = np.abs(left).reshape(reference.tiles.shape).mean(axis=0)
    np.testing.assert_allclose(columns, 0.05, rtol=0.15)


def test_what_is_dimmed_has_the_noise_of_its_contrast():
    reference, image = image_in_a_gradient_of_light()
    sums = tile_sums(reference, image, np.tile([0.0, 1.0], (len(reference.hessian), 1)))
    contrast = fit_tiles(reference, sums).contrast
    means = np.linspace(1.0, 0.55, 112).reshape(7, 16).mean(axis=1)
    assert variance_by_contrast(contrast) == pytest.approx(np.mean(means**-2.0), rel=0.03)
    assert contrast_loss(contrast) == 0.0
    assert variance_by_contrast(np.empty(0)) == 1.0


@pytest.mark.parametrize("contrast", [0.35, 0.6, 1.0])
def test_half_of_the_contrast_is_no_limit_of_its_noise(contrast):
    assert variance_by_contrast(np.full(9, contrast)) == pytest.approx(contrast**-2.0)

"""The sums of a frame without the light of each tile, as the loop takes them."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter

from dic import prepare_blocks, prepare_tiles, tile_gradient, tile_sums, unbiased_gradient
from rig.live.illumination import sums_without_gain_offset, without_gain_offset


def test_what_interpolation_adds_is_taken_off_once():
    image = 128 + 200 * gaussian_filter(np.random.default_rng(4).normal(size=(80, 112)), 1.2)
    reference = replace(prepare_tiles(image, 16), bias=np.array([4e-3, 3e-3]))
    blocks = prepare_blocks(reference, 1)
    sums = tile_sums(reference, image, np.tile([0.25, 0.2], (len(reference.hessian), 1)))
    weight = np.linspace(0.5, 2.0, len(reference.hessian))
    moving = sums_without_gain_offset(blocks, sums, weight)
    seen = unbiased_gradient(without_gain_offset(blocks, weight), moving)
    np.testing.assert_array_equal(seen, -tile_gradient(blocks, sums) * weight[:, None])
    taken_off = sums.gradient - unbiased_gradient(reference, sums)
    assert np.abs(taken_off).min() > 0

"""What tiles leave over beyond noise, and the σ of a wave too short for them."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

import dic
from dic.adaptive.unexplained import unexplained_variance

SHAPE = (90, 113)  # tiles
PIXELS = 23  # that say what a tile leaves over


@pytest.fixture
def variance():
    return np.random.default_rng(3).chisquare(PIXELS, SHAPE) / PIXELS


def test_noise_alone_leaves_nothing_unexplained(variance):
    light = np.linspace(1, 4, SHAPE[1])  # noise that grows with it
    known = np.ones(SHAPE, bool)
    assert not unexplained_variance(variance, known, 0.0).any()
    assert not unexplained_variance(variance * light, known, 0.0).any()
    assert not unexplained_variance(variance, ~known, 0.0).any()


def test_a_part_that_leaves_more_is_found_and_a_line_of_tiles_is_none(variance):
    variance[20:40, 30:60] *= 3
    variance[:, 90] *= 9
    found = unexplained_variance(variance, np.ones(SHAPE, bool), 0.0)
    assert found[24:36, 34:56].mean() == pytest.approx(2.0, rel=0.2)
    found[16:44, 26:64] = 0
    assert not found.any()


def test_a_wave_too_short_for_tiles_is_not_stated_to_be_known(speckle):
    """Of 10 px and 0.5 px, of which a tile holds half: σ was a quarter of the error."""
    shape, drawn = (180, 210), speckle((180, 210))
    y, x = np.indices(shape).astype(float)
    there = y.copy()
    for _ in range(60):
        there = y - 0.5 * np.cos(2 * np.pi * there / 10)
    rng = np.random.default_rng(4)
    first = drawn.draw()
    second = map_coordinates(first, [there, x], order=5, mode="nearest")
    first, second = (image + rng.normal(0, 2.0, shape) for image in (first, second))
    found = dic.adaptive_field(dic.prepare(first), second)
    off = np.column_stack([found.u, found.v - 0.5 * np.cos(2 * np.pi * found.xy[:, 1] / 10)])
    stated = np.column_stack([found.sigma_u, found.sigma_v])
    here = found.valid & np.all(np.abs(found.xy - (105, 90)) < (80, 65), axis=1)
    assert np.sqrt(np.mean(stated[here] ** 2) / np.mean(off[here] ** 2)) > 0.55
    wave = -0.5 * 2 * np.pi / 10 * np.sin(2 * np.pi * found.xy[:, 1] / 10)
    strain = dic.strain(found)
    wrong, spread = (strain.eyy - wave)[here], strain.sigma[here, 1]
    assert np.sqrt(np.mean(spread**2) / np.mean(wrong**2)) > 0.2  # it was 0.05

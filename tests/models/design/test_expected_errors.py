"""What is expected of a bench is what its pixels know, though no image of it is rendered."""

import numpy as np
import pytest
from scipy import ndimage

import dic
import models
from models.design.expected_errors import (
    equal_tiles,
    expected_errors,
    gradient_energy,
    places_over_plate,
    shape_over,
)

NOISE = 1.7  # grey levels


def test_a_patch_of_the_pattern_gives_the_bound_of_the_whole(bench):
    image = bench.image()
    patch = image[60:200, 80:250]
    motions = models.prepare_motions(bench.modes, bench.camera, bench.height, bench.reference.tiles)
    expected = models.prepare_pattern(
        motions, equal_tiles(motions.tiles, gradient_energy(dic.prepare_tiles(patch, 8)))
    )
    true = models.prepare_pattern(motions, bench.reference)
    rng = np.random.default_rng(3)
    touches = np.column_stack([rng.uniform((25, 20), (125, 90), (40, 2)), rng.uniform(1, 3, 40)])
    said, right = (expected_errors(one.forward(NOISE), touches) for one in (expected, true))
    assert np.median(said.place / right.place) == pytest.approx(1.0, abs=0.05)
    assert np.median(said.force / right.force) == pytest.approx(1.0, abs=0.05)
    assert said.place / right.place == pytest.approx(1.0, abs=0.2)  # a pattern is not quite alike


def test_errors_are_the_bound_of_each_touch_alone(bench):
    forward = bench.pattern.forward(NOISE)
    touches = np.array([(60.0, 70.0, 1.0), (100.0, 40.0, 2.0)])
    errors = expected_errors(forward, touches)
    for index, touch in enumerate(touches):
        bound = np.diag(models.cramer_rao(bench.pattern, touch[None], NOISE))
        assert errors.place[index] == pytest.approx(np.sqrt(bound[0] + bound[1]))
        assert errors.force[index] == pytest.approx(np.sqrt(bound[2]))


def test_the_force_for_an_error_is_the_force_that_gives_it(bench):
    forward = bench.pattern.forward(NOISE)
    errors = expected_errors(forward, np.array([(60.0, 70.0, 1.0)]))
    needed = errors.force_for(0.5)
    again = expected_errors(forward, np.array([(60.0, 70.0, needed[0])]))
    assert again.place[0] == pytest.approx(0.5)
    assert again.scaled(3.0).place[0] == pytest.approx(1.5)


def test_gradient_energy_is_that_of_a_wave():
    x, y = np.meshgrid(np.arange(256.0), np.arange(208.0))
    k = 2 * np.pi / 8.0
    wave = 100 + 30 * np.sin(k * x) + 20 * np.sin(k * y)
    assert gradient_energy(dic.prepare_tiles(wave, 16)) == pytest.approx(
        k**2 * (30**2 + 20**2) / 4, rel=0.01
    )


def test_cells_lie_evenly_over_a_plate_that_is_not_square():
    places = places_over_plate((240.0, 110.0), 12)
    assert shape_over((240.0, 110.0), 12) == (12, 6)
    assert places.shape == (72, 2)
    np.testing.assert_allclose(places[0], (10.0, 110 / 12))
    np.testing.assert_allclose(places.mean(axis=0), (120.0, 55.0))
    np.testing.assert_allclose(places[1] - places[0], (20.0, 0.0))


def test_what_aliasing_leaves_grows_as_the_sine_of_half_a_pixel():
    """Blots of 2 px, drawn on a grid of an eighth of a px and moved there."""
    blots = ndimage.gaussian_filter(np.random.default_rng(4).normal(size=(8 * 200, 8 * 240)), 7.0)
    fine = 200.0 * (blots > 0)

    def seen(eighths):
        return np.roll(fine, eighths, axis=1).reshape(200, 8, 240, 8).mean(axis=(1, 3))

    reference = dic.prepare_tiles(seen(0), 16)
    scatter = []
    for eighths in (1, 2, 4, 8):
        flow = np.tile((eighths / 8.0, 0.0), (len(reference.hessian), 1))
        sums = dic.tile_sums(reference, seen(eighths), flow)
        along = -sums.gradient[:, 0] / reference.hessian[:, 0]
        scatter.append(np.var(along[np.abs(reference.tiles.xy - (120, 100)).max(axis=1) < 70]))
    expected = np.square(np.sin(np.pi * np.array([1, 2, 4]) / 8.0))
    assert np.array(scatter[:3]) / scatter[2] == pytest.approx(expected, rel=0.35)
    assert scatter[3] < 1e-3 * scatter[2]


def test_the_part_of_aliasing_is_that_of_the_motions_that_count(bench):
    parts = [
        models.aliased_part(bench.pattern, np.array([75.0, 55.0, force]))
        for force in (1e-3, 2e-3, 1.0, 1e4)
    ]
    assert 0.0 < parts[0] < 1e-3
    assert parts[1] == pytest.approx(4.0 * parts[0], rel=0.01)
    assert parts[1] < parts[2] < 2.0
    assert parts[3] == pytest.approx(1.0, abs=0.3)  # of motions of many pixels

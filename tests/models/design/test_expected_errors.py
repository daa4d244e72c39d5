"""What is expected of a bench is what its pixels know, though no image of it is rendered."""

import numpy as np
import pytest

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

"""The speckle: a smooth function of the plate point, drawn from a seed."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

import synthetic

SPECKLE = synthetic.Speckle(size=(40.0, 25.0), seed=3)
PATTERN = SPECKLE.draw()
places = st.tuples(st.floats(-2, 42), st.floats(-2, 27))


@given(st.lists(places, min_size=1, max_size=20))
def test_light_is_the_product_over_all_spots(points):
    points = np.array(points)
    r = np.linalg.norm(points[:, None] - PATTERN.centres, axis=2)
    t = np.clip((PATTERN.radii - r) / SPECKLE.edge + 0.5, 0, 1)
    edge = 10 * t**3 - 15 * t**4 + 6 * t**5
    expected = np.prod(1 - SPECKLE.contrast * edge, axis=1)
    assert np.allclose(PATTERN.intensity(points), expected, atol=1e-12)


def test_the_ground_goes_on_past_the_edge_of_the_plate():
    rim = np.linspace(0, 40, 200)
    around = np.vstack([np.column_stack([rim, 0 * rim + y]) for y in (0.0, 25.0)])
    assert np.all(PATTERN.intensity(around) == 1)
    assert np.all(PATTERN.intensity([[-1e6, 3], [1e6, 3], [5, -50], [5, 80]]) == 1)


@pytest.mark.parametrize("density", [0.2, 0.5, 0.8])
def test_spots_cover_the_fraction_that_was_asked_for(density):
    pattern = synthetic.speckle((90.0, 60.0), density=density, softness=0.1)
    points = np.random.default_rng(0).uniform((3, 3), (87, 57), (50000, 2))
    assert np.mean(1 - pattern.intensity(points)) == pytest.approx(density, abs=0.02)


def test_light_has_two_continuous_derivatives():
    spot, radius = PATTERN.centres[50], PATTERN.radii[50]
    h = 1e-3
    for corner in (radius - SPECKLE.edge / 2, radius + SPECKLE.edge / 2):
        line = spot + np.column_stack([corner + h * np.arange(-2, 3), np.zeros(5)])
        second = np.diff(PATTERN.intensity(line), 2) / h**2
        # A kink in the light would give a second difference of order 1/h, a jump of s″ one of 1.
        assert np.ptp(second) < 60 * 3 * h / SPECKLE.edge**3


def test_the_same_seed_draws_the_same_spots_and_another_seed_does_not():
    again = synthetic.Speckle(size=(40.0, 25.0), seed=3).draw()
    other = synthetic.Speckle(size=(40.0, 25.0), seed=4).draw()
    assert np.array_equal(again.centres, PATTERN.centres)
    assert not np.array_equal(other.centres, PATTERN.centres)


@pytest.mark.parametrize(
    ("bad", "sentence"),
    [
        ({"diameter": 0.0}, "diameter must be positive, got 0.0 mm"),
        ({"softness": 0.0}, "softness must lie in"),
        ({"softness": 0.9}, "0 < softness ≤ 0.8 of the diameter, got 0.9"),
        ({"density": 1.0}, "density must lie in"),
        ({"density": 0.0}, "density must lie in"),
        ({"contrast": 1.5}, "contrast must lie in"),
        ({"size": (254.0, 2.0)}, "plate must be at least"),
        ({"size": (254.0, np.nan)}, "plate must be at least"),
    ],
)
def test_bad_speckle_is_named_in_one_sentence(bad, sentence):
    with pytest.raises(ValueError, match=sentence):
        synthetic.Speckle(**bad)

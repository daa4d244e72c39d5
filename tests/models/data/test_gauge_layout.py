"""Places of the gauges and of the touches that train a net."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from models.data import dataset, gauge_layout

PAPER = (100.0, 100.0)


@pytest.mark.parametrize(
    "reading", [gauge_layout.gauges_on_edges, gauge_layout.gauges_inside_edges]
)
def test_both_readings_of_the_paper_give_72_points_at_5_mm_and_360_at_1_mm(reading):
    assert reading(PAPER, 5.0).shape == (72, 2)
    assert reading(PAPER, 1.0).shape == (360, 2)


def test_reading_b_stands_18_a_side_on_the_edges_from_7_5_to_92_5():
    places = gauge_layout.gauges_on_edges(PAPER)
    bottom = np.sort(places[places[:, 1] == 0.0][:, 0])
    np.testing.assert_allclose(bottom, np.arange(7.5, 93.0, 5.0))
    assert np.all(np.any((places == 0.0) | (places == 100.0), axis=1))


def test_reading_a_is_the_square_from_5_to_95_with_each_corner_once():
    places = gauge_layout.gauges_inside_edges(PAPER)
    assert np.all(np.any((places == 5.0) | (places == 95.0), axis=1))
    for corner in ([5, 5], [95, 5], [5, 95], [95, 95]):
        assert np.sum(np.all(places == corner, axis=1)) == 1


@given(
    across=st.integers(1, 12),
    along=st.integers(1, 12),
    spacing=st.floats(0.1, 20.0),
    margin=st.floats(0.5, 30.0),
)
def test_a_ring_is_symmetric_closed_and_without_doubles(across, along, spacing, margin):
    size = (2 * margin + across * spacing, 2 * margin + along * spacing)
    for reading in (gauge_layout.gauges_on_edges, gauge_layout.gauges_inside_edges):
        places = reading(size, spacing, margin)
        assert len(places) == 2 * (across + along)
        for image in (places, size - places, np.abs(places - [size[0], 0.0])):
            distances = np.linalg.norm(image[:, None] - places, axis=2)
            assert np.max(np.min(distances, axis=1)) < 1e-9 * max(size)
        apart = np.linalg.norm(places[:, None] - places, axis=2) + 1e9 * np.eye(len(places))
        assert apart.min() > 0.5 * spacing * (1 - 1e-9)


@pytest.mark.parametrize("spacing", [7.0, 0.0, -5.0, float("nan"), float("inf")])
def test_a_spacing_that_does_not_divide_the_edge_is_refused_with_one_that_does(spacing):
    with pytest.raises(ValueError, match=r"spacing must divide the 90 mm .* use \d+"):
        gauge_layout.gauges_on_edges((100.0, 100.0), spacing)


@pytest.mark.parametrize("margin", [-1.0, 50.0, 60.0, float("nan")])
def test_a_margin_that_leaves_no_room_is_refused(margin):
    with pytest.raises(ValueError, match="margin must leave room on an edge of 100 mm"):
        gauge_layout.gauges_inside_edges((100.0, 100.0), 5.0, margin)


def test_training_touches_are_289_at_10_15_to_90():
    places = dataset.grid_places(PAPER, spacing=5.0, margin=10.0)
    assert places.shape == (289, 2)
    np.testing.assert_allclose(np.unique(places), np.arange(10.0, 91.0, 5.0))


def test_validation_touches_are_196_between_the_training_touches():
    training = dataset.grid_places(PAPER, spacing=5.0, margin=10.0)
    places = dataset.midpoint_places(PAPER, spacing=5.0, margin=10.0, count=14)
    assert places.shape == (196, 2)
    assert places.min() == 12.5
    assert places.max() == 87.5
    assert np.linalg.norm(places[:, None] - training, axis=2).min() > 0.1


def test_grids_follow_the_sides_of_an_oblong_plate():
    places = dataset.grid_places((60.0, 40.0), spacing=10.0, margin=5.0)
    assert places.shape == (6 * 4, 2)
    assert places[:, 0].max() == 55.0
    assert places[:, 1].max() == 35.0
    between = dataset.midpoint_places((60.0, 40.0), spacing=10.0, margin=5.0, count=3)
    np.testing.assert_allclose(np.unique(between[:, 1]), [10.0, 20.0, 30.0])


def test_random_touches_fill_the_training_rectangle_and_repeat_with_their_seed():
    places = [
        dataset.random_places((60.0, 40.0), 10.0, 2000, np.random.default_rng(seed))
        for seed in (3, 3, 4)
    ]
    np.testing.assert_array_equal(places[0], places[1])
    assert not np.array_equal(places[0], places[2])
    assert np.all(places[0] >= 10.0)
    assert np.all(places[0] <= [50.0, 30.0])
    np.testing.assert_allclose(places[0].mean(axis=0), [30.0, 20.0], atol=1.2)
    np.testing.assert_allclose(np.ptp(places[0], axis=0), [40.0, 20.0], atol=0.5)


def test_a_set_of_no_touches_is_refused():
    with pytest.raises(ValueError, match="at least 1, got 0"):
        dataset.random_places(PAPER, 10.0, 0, np.random.default_rng(0))
    with pytest.raises(ValueError, match="at least 2, got 1"):
        dataset.midpoint_places(PAPER, 5.0, 10.0, 1)

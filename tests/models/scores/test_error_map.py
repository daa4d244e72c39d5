"""Errors as a map over the plate."""

import numpy as np

from models.scores.error_map import error_map


def test_cells_are_where_the_touches_are_x_along_columns():
    xy = np.array([[5.0, 5.0], [9.0, 8.0], [119.0, 5.0], [5.0, 79.0]])
    found = error_map(xy, np.array([1.0, 3.0, 7.0, 9.0]), (120.0, 80.0))
    assert found.mean.shape == (8, 12)
    np.testing.assert_allclose(found.x[[0, -1]], [5.0, 115.0])
    np.testing.assert_allclose(found.y[[0, -1]], [5.0, 75.0])
    assert (found.mean[0, 0], found.largest[0, 0], found.count[0, 0]) == (2.0, 3.0, 2)
    assert found.mean[0, -1] == 7.0
    assert found.mean[-1, 0] == 9.0
    assert np.isnan(found.mean[3, 3])
    assert np.isnan(found.largest[3, 3])


def test_a_touch_that_was_missed_is_counted_and_not_averaged():
    xy = np.array([[5.0, 5.0], [6.0, 6.0], [55.0, 75.0]])
    found = error_map(xy, np.array([2.0, np.nan, np.nan]), (120.0, 80.0))
    assert (found.mean[0, 0], found.count[0, 0]) == (2.0, 2)
    assert found.count[7, 5] == 1
    assert np.isnan(found.mean[7, 5])


def test_touches_on_the_edges_are_on_the_map():
    corners = np.array([[0.0, 0.0], [120.0, 80.0]])
    assert error_map(corners, np.ones(2), (120.0, 80.0)).count.sum() == 2

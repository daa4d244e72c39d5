"""Rows that are read one after the other: when, and what moves meanwhile."""

import numpy as np
import pytest

import synthetic

CAMERA = synthetic.pinhole_above((150.0, 110.0), 300.0, (253, 197))


def test_rows_are_read_from_the_first_to_the_last():
    px = np.array([[3.0, 0.0], [200.0, 98.0], [0.0, 196.0], [9.0, -30.0], [9.0, 400.0]])
    np.testing.assert_allclose(synthetic.row_fraction(px, 197), [-0.5, 0.0, 0.5, -0.5, 0.5])


@pytest.mark.parametrize("instants", [2, 5])
def test_a_steady_motion_is_met_where_it_is_when_each_row_is_read(instants):
    pattern = synthetic.speckle((150.0, 110.0), diameter=4.0)
    warper = synthetic.prepare_warp(pattern, CAMERA, 0.5)
    moved = [
        np.full((len(warper.points), 3), [at, 0.0, 0.0]) for at in np.linspace(-1, 1, instants)
    ]
    seen = synthetic.while_read(moved, warper.read_at)
    rows = CAMERA.project(np.column_stack([warper.points, np.full(len(seen), 0.5)]))[:, 1]
    np.testing.assert_allclose(seen[:, 0], 2 * np.clip(rows / 196 - 0.5, -0.5, 0.5), atol=1e-9)


def test_what_has_no_two_instants_is_refused():
    with pytest.raises(ValueError, match=r"2 instants or more for 4 points, got \(1, 4, 3\)"):
        synthetic.while_read([np.zeros((4, 3))], np.zeros(4))

"""Plate, touch and mesh refuse what is no plate, in one sentence that says what to do."""

import math

import numpy as np
import pytest

import fe


def plate(**changes):
    return fe.Plate(
        **{"size": (120.0, 80.0), "thickness": 2.0, "young": 3000.0, "poisson": 0.38} | changes
    )


def test_a_point_on_the_border_of_patches_belongs_to_the_side_of_larger_x_and_y():
    inner = fe.Patch((20.0, 50.0), (10.0, 40.0), 3.0, 9000.0)
    corner = fe.Patch((90.0, 120.0), (60.0, 80.0), 4.0, 200.0)
    thickness, young = plate(patches=(inner, corner)).material(
        [[20.0, 10.0], [50.0, 20.0], [30.0, 40.0], [19.9, 20.0], [49.9, 39.9], [120.0, 80.0]]
    )
    assert thickness.tolist() == [3.0, 2.0, 2.0, 2.0, 3.0, 4.0]
    assert young.tolist() == [9000.0, 3000.0, 3000.0, 3000.0, 9000.0, 200.0]


def test_rigidity_is_that_of_the_textbook():
    assert math.isclose(plate().rigidity, 3000.0 * 8.0 / (12.0 * (1.0 - 0.38**2)))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"thickness": -1.0}, "plate thickness must be positive and finite, got -1 mm"),
        ({"thickness": math.nan}, "plate thickness must be positive and finite, got nan mm"),
        ({"young": 0.0}, "Young's modulus must be positive and finite, got 0 MPa"),
        ({"young": math.inf}, "Young's modulus must be positive and finite, got inf MPa"),
        ({"size": (0.0, 80.0)}, "plate side a must be positive and finite, got 0 mm"),
        ({"size": (120.0, -80.0)}, "plate side b must be positive and finite, got -80 mm"),
        ({"size": (120.0,)}, "plate size must be two sides in mm"),
        ({"poisson": 0.5}, "Poisson's ratio must lie between -1 and 0.5, got 0.5"),
        ({"poisson": -1.0}, "Poisson's ratio must lie between -1 and 0.5, got -1.0"),
        ({"poisson": math.nan}, "Poisson's ratio must lie between -1 and 0.5, got nan"),
        ({"edges": "clamped"}, "plate edges must be Clamped()"),
    ],
)
def test_a_plate_that_cannot_be_is_refused(changes, sentence):
    with pytest.raises(ValueError, match="^" + sentence.replace("(", r"\(").replace(")", r"\)")):
        plate(**changes)


@pytest.mark.parametrize(
    "place", [(math.nan, 1.0, 1.0), (1.0, math.inf, 1.0), (1.0, 1.0, math.nan)]
)
def test_a_touch_is_finite(place):
    with pytest.raises(ValueError, match="must be finite"):
        fe.Touch(*place)


@pytest.mark.parametrize("place", [(-0.1, 40.0), (60.0, 80.1), (121.0, 90.0)])
def test_a_touch_outside_the_plate_is_refused(place):
    mesh = fe.Mesh((120.0, 80.0), (12, 8))
    with pytest.raises(ValueError, match=r"^touch 1 must lie on the plate, 0 to 120 by 0 to 80 mm"):
        fe.deflect(plate(), [fe.Touch(60.0, 40.0, 1.0), fe.Touch(*place, 1.0)], mesh)


@pytest.mark.parametrize("place", [(math.nan, 40.0), (60.0, -1.0)])
def test_a_gauge_outside_the_plate_is_refused(place):
    with pytest.raises(ValueError, match=r"^gauge 0 must lie on the plate"):
        fe.influence(plate(), [place], fe.Mesh((120.0, 80.0), (12, 8)))


def test_points_have_two_columns():
    state = fe.deflect(plate(), [], fe.Mesh((120.0, 80.0), (12, 8)))
    with pytest.raises(ValueError, match=r"^points must have shape \(K, 2\) in mm, got \(2,\)"):
        state.strain([60.0, 40.0])


def test_a_point_on_the_edge_but_for_rounding_is_on_the_plate():
    state = fe.deflect(plate(), [], fe.Mesh((120.0, 80.0), (12, 8)))
    state.strain([[120.0 * (1 + 1e-15), -1e-13]])


def test_a_mesh_fits_its_plate():
    with pytest.raises(ValueError, match=r"^mesh must have the size of the plate"):
        fe.deflect(plate(), [], fe.Mesh((80.0, 120.0), (12, 8)))
    with pytest.raises(ValueError, match=r"^mesh must have at least 6 elements"):
        fe.Mesh((120.0, 80.0), (12, 5))


@pytest.mark.parametrize(
    ("size", "counts"),
    [
        ((100.0, 100.0), (120, 120)),
        ((254.0, 100.0), (192, 76)),
        ((80.0, 120.0), (98, 148)),
        ((2.5, 250.0), (16, 1600)),
    ],
)
def test_the_default_mesh_has_as_many_nearly_square_elements_as_a_square_of_120(size, counts):
    assert fe.default_mesh(plate(size=size)).counts == counts


def test_values_read_from_a_state_cannot_be_changed():
    state = fe.deflect(plate(), [fe.Touch(50.0, 40.0, 1.0)], fe.Mesh((120.0, 80.0), (12, 8)))
    with pytest.raises(ValueError, match="read-only"):
        state.values[0] = 1.0
    assert np.ptp(state.values) > 0

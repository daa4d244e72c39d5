"""The material point of a pixel: found to 1e-4 px, or a sentence says why not."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import synthetic
from synthetic.inverse import invert

PLATE = (60.0, 40.0)
Z = 0.5
LENS = synthetic.Distortion(k1=-0.1, p1=1e-3, k3=0.02)
ABOVE = synthetic.pinhole_above(PLATE, 200.0, (250, 160), margin=0.1, distortion=LENS)
PARALLEL = synthetic.telecentric_above(PLATE, (250, 160), margin=0.1)
OBLIQUE = synthetic.Camera(
    (250, 160), 700.0, (120.0, 80.0), synthetic.look_at((90.0, -40.0, 180.0), (30.0, 20.0, 0.0))
)
OFFSETS = np.array([[0.0, 0.0], [0.4, -0.3], [-0.49, 0.45]])


def wavy(points):
    x, y = (2 * np.pi * points / (9.0, 7.0)).T
    return np.column_stack([0.3 * np.sin(y), 0.25 * np.cos(x + y), 0.5 * np.sin(x)])


def worst(camera, displacement):
    """Largest distance, px, between a pixel and where its material point is seen."""
    inverse = invert(camera, displacement, PLATE, Z)
    x, y = np.meshgrid(*(np.arange(float(length)) for length in camera.size))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    pixels = pixels[inverse.covers(pixels)]
    off = []
    for offset, points in zip(OFFSETS, inverse.follow(pixels, OFFSETS), strict=True):
        on = ((points >= 0) & (points <= PLATE)).all(axis=1)
        moved = np.column_stack([points[on], np.full(on.sum(), Z)]) + displacement(points[on])
        off.append(np.abs(camera.project(moved) - pixels[on] - offset).max())
        assert on.sum() > 5000
    return max(off)


@pytest.mark.parametrize("camera", [ABOVE, PARALLEL, OBLIQUE])
def test_a_material_point_is_seen_where_it_was_looked_for(camera):
    # Measured 2e-5 px.
    assert worst(camera, wavy) < 1e-4


@given(st.floats(-180, 180), st.floats(-0.4, 0.5), st.floats(-0.4, 0.5), st.floats(-0.3, 0.3))
@settings(max_examples=15)
def test_large_rotation_and_strain_change_nothing_of_that(degrees, exx, eyy, exy):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    F = np.array([[c, -s], [s, c]]) @ [[1 + exx, exy], [exy, 1 + eyy]]

    def displacement(points):
        moved = (points - (30.0, 20.0)) @ (F - np.eye(2)).T
        return np.column_stack([moved, 0.02 * points[:, 0]])

    assert worst(PARALLEL, displacement) < 1e-4


def test_the_displacement_is_asked_for_points_of_the_plate_alone():
    asked = []

    def displacement(points):
        asked.append(points)
        return wavy(points)

    assert worst(ABOVE, displacement) < 1e-4
    asked = np.vstack(asked)
    assert asked.min() >= 0
    assert np.all(asked.max(axis=0) <= PLATE)


def test_pixels_past_the_plate_see_nothing_of_it():
    inverse = invert(PARALLEL, lambda points: np.zeros((len(points), 3)), PLATE, Z)
    corner, middle = inverse.covers(np.array([[0.0, 0.0], [120.0, 80.0]]))
    assert middle
    assert not corner


def folded(points):
    x = points[:, 0] - 25
    return np.column_stack([-4 * np.tanh(x), 0 * x, 0 * x])


def rolled_up(points):
    """Bend the plate in its own plane to a ring and a bit: no part of it turns its back."""
    angle, radius = 2.2 * np.pi * points[:, 0] / 60, 6 + points[:, 1] / 4
    place = (30, 20) + radius[:, None] * np.column_stack([-np.cos(angle), np.sin(angle)])
    return np.column_stack([place - points, 0 * angle])


def torn(points):
    return np.column_stack([0.3 * (points[:, 0] > 31.3), np.zeros((len(points), 2))])


@pytest.mark.parametrize(
    ("displacement", "sentence"),
    [
        (folded, "folds the image in"),
        (rolled_up, "folds the plate over itself in"),
        (torn, r"must be found to 0.0001 px, got \d+ pixels without one after 30 steps"),
    ],
)
def test_a_pixel_without_one_material_point_is_named_in_one_sentence(displacement, sentence):
    with pytest.raises(ValueError, match=sentence):
        worst(PARALLEL, displacement)

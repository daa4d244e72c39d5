"""The projector's image: a spot where the touch is, dim, soft, and as large as the force says."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rig.live.snapshot import Mark
from rig.projector.markers import PEAK, Screen, draw_marks, fit_plate, project

SIZE, PLATE = (641, 400), (254.0, 180.0)
SCREEN = fit_plate(SIZE, PLATE)


def centroid(image):
    light = image[..., 1].astype(float)
    rows, columns = np.indices(light.shape)
    return np.array([(columns * light).sum(), (rows * light).sum()]) / light.sum()


def test_the_plate_fills_the_image_up_to_the_margin_with_y_upwards():
    corners = project(SCREEN.T_px_plate, np.array([[0.0, 0.0], PLATE]))
    assert corners[0, 1] > corners[1, 1]
    assert corners[0, 0] < corners[1, 0]
    assert corners.mean(0) == pytest.approx([320.0, 199.5])
    assert corners[0, 1] - corners[1, 1] == pytest.approx(0.9 * 400)


@given(
    st.floats(50, 200), st.floats(50, 130), st.floats(0.2, 3), st.floats(0.0, 4.0), st.floats(0, 3)
)
def test_the_light_of_a_mark_is_centred_on_its_touch(x, y, force, a, angle):
    image = draw_marks([Mark(x, y, force, (a, a / 2, angle))], SCREEN)
    expected = project(SCREEN.T_px_plate, np.array([[x, y]]))[0]
    assert np.abs(centroid(image) - expected).max() < 0.25  # measured 0.1 px


@pytest.mark.parametrize("angle", [0.5, -0.9, 2.2])
def test_the_ring_is_turned_as_the_uncertainty_is(angle):
    image = draw_marks([Mark(127.0, 90.0, 0.1, (20.0, 6.0, angle))], SCREEN)
    rows, columns = np.indices(image.shape[:2])
    light = image[..., 0].astype(float).ravel()
    # y of the plate runs up, that of the image down
    places = np.column_stack([columns.ravel() - 320.0, 199.5 - rows.ravel()])
    spread = (places * light[:, None]).T @ places / light.sum()
    long = np.linalg.eigh(spread)[1][:, 1]
    assert abs(long @ (np.cos(angle), np.sin(angle))) > 0.999


def test_a_mark_follows_a_slanting_projector():
    slant = Screen(SIZE, np.array([[2.1, 0.2, 20], [-0.1, -1.9, 380], [4e-4, -2e-4, 1.0]]))
    image = draw_marks([Mark(140.0, 70.0, 0.3)], slant)
    expected = project(slant.T_px_plate, np.array([[140.0, 70.0]]))[0]
    assert np.abs(centroid(image) - expected).max() < 0.5


def test_the_ground_is_black_and_nothing_is_brighter_than_a_quarter():
    marks = [Mark(60.0, 60.0, 4.0, (2, 1, 0)), Mark(64.0, 62.0, 2.0, (6, 3, 1))]
    image = draw_marks(marks, SCREEN)
    assert image.max() <= PEAK
    assert not image[:, -100:].any()
    assert not draw_marks([], SCREEN).any()


def test_no_edge_is_hard():
    image = draw_marks([Mark(127.0, 90.0, 2.0, (8.0, 4.0, 0.5))], SCREEN).astype(int)
    steps = max(np.abs(np.diff(image, axis=axis)).max() for axis in (0, 1))
    assert steps <= 0.5 * PEAK


def test_more_force_gives_more_light():
    light = [int(draw_marks([Mark(127.0, 90.0, f)], SCREEN).sum()) for f in (0.5, 1, 2, 4)]
    assert light == sorted(light)
    assert light[3] > 3 * light[1]


def test_the_ring_lies_at_two_sigma_along_its_own_axes():
    a, b, angle = 20.0, 10.0, 0.6
    image = draw_marks([Mark(127.0, 90.0, 0.1, (a, b, angle))], SCREEN)
    axis = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-np.sin(angle), np.cos(angle)])
    for direction, length in ((axis, 2 * a), (across, 2 * b)):
        along = np.linspace(0.7, 1.3, 241)
        places = (127.0, 90.0) + along[:, None] * length * direction
        columns, rows = np.rint(project(SCREEN.T_px_plate, places)).astype(int).T
        light = image[rows, columns, 0].astype(float)
        assert (along * light).sum() / light.sum() == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("place", [(-500.0, 50.0), (0.0, 0.0), (254.0, 180.0), (127.0, 900.0)])
def test_a_mark_at_or_beyond_the_border_is_cut_not_refused(place):
    assert draw_marks([Mark(*place, 2.0)], SCREEN).shape == (400, 641, 3)


def test_sizes_that_are_not_positive_are_refused():
    with pytest.raises(ValueError, match="projector size must be positive, got 0 x 800 px"):
        fit_plate((0, 800), PLATE)
    with pytest.raises(ValueError, match="plate size must be positive, got -1 x 180 mm"):
        fit_plate(SIZE, (-1.0, 180.0))

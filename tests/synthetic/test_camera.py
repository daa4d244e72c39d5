"""The pinhole: projection, its inverse and its derivative, and the motion that it sees."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

import synthetic

PLATE = (254.0, 180.0)
ABOVE = synthetic.pinhole_above(PLATE, stand_off=500.0, pixels=(640, 480))


def oblique(tilt=(0.2, -0.3, 0.4), pixels=(640, 480)) -> synthetic.Camera:
    """Turn the camera about the centre of the plate."""
    centre = np.array([PLATE[0] / 2, PLATE[1] / 2, 0.0])
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_rotvec(tilt).as_matrix()
    turn[:3, 3] = centre - turn[:3, :3] @ centre
    return synthetic.Camera(pixels, 900.0, (310.0, 250.0), ABOVE.T_cam_plate @ turn)


tilts = st.tuples(*[st.floats(-0.5, 0.5)] * 3)
places = st.tuples(st.floats(0, PLATE[0]), st.floats(0, PLATE[1]), st.floats(-3, 3))


@given(tilts, places)
def test_a_pixel_sees_the_point_that_projects_to_it(tilt, place):
    camera = oblique(tilt)
    point = np.array([place])
    back = camera.on_plate(camera.project(point), place[2])
    assert np.allclose(back, point[:, :2], atol=1e-9)


@given(tilts, places)
def test_the_jacobian_is_the_derivative_of_the_projection(tilt, place):
    camera = oblique(tilt)
    h = 1e-3
    steps = np.array(place) + h * np.vstack([np.eye(3), -np.eye(3)])
    px = camera.project(steps)
    assert np.allclose(camera.jacobian([place])[0], (px[:3] - px[3:]).T / (2 * h), atol=1e-7)


def test_plate_x_runs_right_and_plate_y_runs_up_in_the_image():
    px = ABOVE.project([[0, 0, 0], [PLATE[0], 0, 0], [0, PLATE[1], 0]])
    assert px[1, 0] > px[0, 0]
    assert px[1, 1] == pytest.approx(px[0, 1])
    assert px[2, 1] < px[0, 1]
    assert np.linalg.det(ABOVE.T_cam_plate[:3, :3]) == pytest.approx(1)


def test_the_plate_fills_the_tighter_direction_less_the_margin():
    camera = synthetic.pinhole_above((254.0, 100.0), pixels=(640, 480), margin=0.05)
    left, right = camera.project([[0, 50, 0], [254, 50, 0]])[:, 0]
    assert left == pytest.approx(-0.5 + 0.05 * 640)
    assert right == pytest.approx(639.5 - 0.05 * 640)


def test_scale_is_the_size_of_a_pixel_on_the_plate():
    px = ABOVE.project([[127, 90, 0], [128, 90, 0]])
    assert ABOVE.scale == pytest.approx(1 / (px[1, 0] - px[0, 0]))


def test_out_of_plane_motion_moves_a_point_away_from_the_axis_by_w_x_over_the_distance():
    z, w = 0.5, 0.2
    points = np.array([[200.0, 30.0], [20.0, 170.0]])
    lever = (points - np.array(PLATE) / 2) * [1, -1]
    expected = ABOVE.focal * lever * (1 / (500 - z - w) - 1 / (500 - z))
    moved = synthetic.image_motion(ABOVE, points, [[0, 0, w]] * 2, z)
    assert np.allclose(moved, expected, atol=1e-10)


def test_seen_is_the_first_order_of_motion():
    camera, z, step = oblique(), 0.5, 1e-4
    px = np.array([[100.0, 60.0], [400.0, 300.0], [320.0, 200.0]])
    rng = np.random.default_rng(1)
    w, dw = rng.normal(size=(3, 4)), rng.normal(size=(3, 4, 2))
    linear = synthetic.image_motion_basis(camera, px, w, dw, z)
    points = camera.on_plate(px, z)
    for k in range(4):
        face = np.column_stack([-z * dw[:, k], w[:, k]])
        ahead = synthetic.image_motion(camera, points, step * face, z)
        behind = synthetic.image_motion(camera, points, -step * face, z)
        assert np.allclose(linear[:, :, k], (ahead - behind) / (2 * step), atol=1e-6)


def test_rigid_columns_are_shift_rotation_and_scale_about_the_image_centre():
    px = np.array([[0.0, 0.0], [639.0, 100.0], [300.0, 479.0]])
    columns = synthetic.rigid_motion_basis(ABOVE, px)
    middle = np.array([319.5, 239.5])
    angle = 1e-6
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    assert np.array_equal(columns[:, :, :2], np.tile(np.eye(2), (3, 1, 1)))
    assert np.allclose(columns[:, :, 2] * angle, (px - middle) @ turn.T - (px - middle), atol=1e-9)
    assert np.allclose(columns[:, :, 3], px - middle)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: synthetic.pinhole_above(PLATE, stand_off=-1), "stand-off must be positive"),
        (lambda: synthetic.pinhole_above(PLATE, margin=0.5), "margin must lie"),
        (lambda: synthetic.pinhole_above((0, 1)), "plate size must be positive"),
        (lambda: synthetic.Camera((0, 4), 1, (0, 0), np.eye(4)), "image size"),
        (lambda: synthetic.Camera((4, 4), 0, (0, 0), np.eye(4)), "focal length"),
        (lambda: synthetic.Camera((4, 4), 1, (0, 0), np.diag([1, 1, -1, 1])), "right-handed"),
        (lambda: ABOVE.project([[0, 0, 600]]), "in front of the camera"),
        (lambda: ABOVE.project([[0, 0]]), r"shape \(K, 3\)"),
        (lambda: ABOVE.project([[0, np.nan, 0]]), "finite"),
        (lambda: ABOVE.on_plate([[0, 0]], 600), "does not see the plane"),
        (lambda: synthetic.image_motion(ABOVE, [[0, 0]], [[0, 0, 0]] * 2, 0), "1 rows, got 2"),
        (
            lambda: synthetic.image_motion_basis(ABOVE, [[0, 0]], [[1]], [[1, 2]], 0),
            "values and slopes",
        ),
        (lambda: synthetic.Camera((4, 4), 1, (0, 0), np.eye(4)).scale, "optical axis"),
    ],
)
def test_bad_input_is_named_in_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()

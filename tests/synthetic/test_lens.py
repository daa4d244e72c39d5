"""Lenses and other cameras: distortion as OpenCV has it, parallel rays, and poses."""

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st

import synthetic

PLATE = (254.0, 180.0)
LENS = synthetic.Distortion(k1=-0.21, k2=0.08, p1=1.3e-3, p2=-2.1e-3, k3=-0.02)
VIEW = synthetic.look_at((180.0, -60.0, 420.0), (120.0, 95.0, 0.0), up=(0.2, 1.0, 0.1))
CAMERA = synthetic.Camera((640, 480), 610.0, (310.0, 250.0), VIEW, LENS)
places = st.tuples(st.floats(0, PLATE[0]), st.floats(0, PLATE[1]), st.floats(-3, 3))
coefficients = st.builds(
    synthetic.Distortion,
    *[st.floats(-0.1, 0.1)] * 2,
    *[st.floats(-2e-3, 2e-3)] * 2,
    st.floats(-0.02, 0.02),
)


def opencv(camera, points):
    K = np.diag([camera.focal, camera.focal, 1.0])
    K[:2, 2] = camera.centre
    lens = camera.distortion
    rotation, _ = cv2.Rodrigues(camera.T_cam_plate[:3, :3])
    px, _ = cv2.projectPoints(
        np.asarray(points),
        rotation,
        camera.T_cam_plate[:3, 3],
        K,
        np.array([lens.k1, lens.k2, lens.p1, lens.p2, lens.k3]),
    )
    return px[:, 0]


@given(coefficients, st.lists(places, min_size=1, max_size=9))
def test_a_lens_sees_points_where_opencv_sees_them(lens, points):
    camera = synthetic.Camera(CAMERA.size, CAMERA.focal, CAMERA.centre, VIEW, lens)
    assert np.allclose(camera.project(points), opencv(camera, points), rtol=0, atol=1e-9)


@given(coefficients, places)
def test_a_pixel_sees_the_point_that_projects_to_it_through_the_lens(lens, place):
    camera = synthetic.Camera(CAMERA.size, CAMERA.focal, CAMERA.centre, VIEW, lens)
    back = camera.on_plate(camera.project([place]), place[2])
    assert np.allclose(back, [place[:2]], rtol=0, atol=1e-8)


@given(coefficients, places)
def test_the_jacobian_holds_the_lens(lens, place):
    camera = synthetic.Camera(CAMERA.size, CAMERA.focal, CAMERA.centre, VIEW, lens)
    h = 1e-3
    px = camera.project(np.array(place) + h * np.vstack([np.eye(3), -np.eye(3)]))
    assert np.allclose(camera.jacobian([place])[0], (px[:3] - px[3:]).T / (2 * h), atol=1e-7)


def test_a_lens_that_turns_back_says_where():
    lens = synthetic.Distortion(k1=-0.3)
    assert lens.reach == pytest.approx(1 / np.sqrt(0.9))
    assert synthetic.Distortion(k1=0.3, k2=0.1).reach == np.inf
    wide = synthetic.Camera((640, 480), 200.0, (320.0, 240.0), np.eye(4), lens)
    with pytest.raises(ValueError, match=r"stay within 1\.05 off the axis"):
        wide.project([[1.2, 0.0, 1.0]])
    with pytest.raises(ValueError, match=r"got 1 of 2 pixels beyond the 1\.05 off the axis"):
        wide.on_plate([[320.0, 240.0], [0.0, 0.0]], 500.0)


@pytest.mark.parametrize("radial", [(-0.1, -0.2, 0.0), (0.05, -0.3, -0.1), (-0.2, 0.05, -0.3)])
def test_a_lens_turns_back_where_it_no_longer_moves_rays_outwards(radial):
    k1, k2, k3 = radial
    lens = synthetic.Distortion(k1=k1, k2=k2, k3=k3)
    rays = lens.reach * np.column_stack([np.linspace(0, 1, 50), np.zeros(50)])
    outwards = lens.jacobian(rays)[:, 0, 0]
    assert outwards[-1] == pytest.approx(0.0, abs=1e-12)
    assert np.all(outwards[:-1] > 0)


ABOVE = synthetic.telecentric_above(PLATE, pixels=(640, 480))


@given(places)
def test_a_telecentric_pixel_sees_the_point_that_projects_to_it(place):
    oblique = synthetic.Telecentric((640, 480), 0.4, (300.0, 200.0), VIEW)
    for camera in (ABOVE, oblique):
        back = camera.on_plate(camera.project([place]), place[2])
        assert np.allclose(back, [place[:2]], rtol=0, atol=1e-9)
        h = np.eye(3)
        px = camera.project(np.array(place) + np.vstack([h, -h]))
        assert np.allclose(camera.jacobian([place])[0], (px[:3] - px[3:]).T / 2, atol=1e-9)


def test_a_telecentric_camera_sees_no_motion_along_its_view():
    w = np.column_stack([np.zeros((2, 2)), [0.7, -1.3]])
    moved = synthetic.image_motion(ABOVE, [[200.0, 30.0], [20.0, 170.0]], w, 0.5)
    assert np.array_equal(moved, np.zeros((2, 2)))
    seen = synthetic.image_motion_basis(ABOVE, [[100.0, 60.0]], [[1.0]], [[[0.3, -0.2]]], z=0.5)
    assert np.allclose(seen[0, :, 0], np.array([-0.15, -0.1]) / ABOVE.scale)


def test_both_cameras_above_a_plate_frame_it_alike():
    corners = np.array([[0, 0, 0], [254, 0, 0], [0, 180, 0]])
    pinhole = synthetic.pinhole_above(PLATE, pixels=(640, 480))
    assert np.allclose(ABOVE.project(corners), pinhole.project(corners))
    assert ABOVE.scale == pytest.approx(pinhole.scale)


def test_a_camera_that_looks_at_a_point_sees_it_in_its_middle_with_up_upwards():
    camera = synthetic.Camera((640, 480), 600.0, (320.0, 240.0), VIEW)
    target, above = camera.project([[120.0, 95.0, 0.0], [122.0, 105.0, 1.0]])
    assert np.allclose(target, [320.0, 240.0])
    assert above[0] == pytest.approx(320.0)
    assert above[1] < 240
    assert np.allclose(camera.position, [180.0, -60.0, 420.0])


def test_a_plate_turned_under_the_camera_keeps_its_pivot_and_its_angles():
    pivot, angle = (100.0, 40.0, 0.0), 0.3
    turned = synthetic.rotated(VIEW, (0.0, 0.0, angle), pivot)
    before, after = (np.linalg.inv(pose) for pose in (VIEW, turned))
    moved = before @ turned @ (110.0, 40.0, 0.0, 1.0)
    assert np.allclose(before @ turned @ (*pivot, 1.0), (*pivot, 1.0))
    assert np.allclose(moved[:3] - pivot, 10 * np.array([np.cos(angle), np.sin(angle), 0]))
    assert np.linalg.det(after[:3, :3]) == pytest.approx(1)
    assert np.array_equal(synthetic.rotated(VIEW, (0, 0, 0), pivot), VIEW)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: synthetic.Distortion(k1=np.nan), "lens distortion must be finite"),
        (lambda: synthetic.look_at((0, 0, 1), (0, 0, 1)), "apart from its target"),
        (lambda: synthetic.look_at((0, 0, 1), (0, 5, 1)), "its line upwards"),
        (lambda: synthetic.Telecentric((4, 4), 0, (0, 0), np.eye(4)), "scale must be positive"),
        (lambda: synthetic.Telecentric((4, 0), 1, (0, 0), np.eye(4)), "image size"),
        (lambda: synthetic.Telecentric((4, 4), 1, (0, 0), np.eye(3)), "right-handed"),
        (lambda: ABOVE.project([[0, 0, 600]]), "in front of the camera"),
        (lambda: ABOVE.on_plate([[0, 0]], 600), "does not see the plane"),
    ],
)
def test_bad_input_is_named_in_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()

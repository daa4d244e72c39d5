"""A camera under the plate: by the equation of the pinhole, and by what a mirror would show."""

import numpy as np
import pytest

import synthetic

PLATE, STAND_OFF, THICKNESS = (254.0, 180.0), 400.0, 3.0
SIZE = (252, 196)
BELOW = synthetic.pinhole_below(PLATE, STAND_OFF, SIZE)
ABOVE = synthetic.pinhole_above(PLATE, STAND_OFF, SIZE)
POINTS = np.random.default_rng(1).uniform((0, 0), PLATE, (40, 2))


def by_hand(points):
    """Pixels of (K, 3) mm: x runs left, y up, and what lies higher is farther."""
    (a, b), (width, height) = PLATE, SIZE
    depth = STAND_OFF + points[:, 2]
    x = (width - 1) / 2 - BELOW.focal * (points[:, 0] - a / 2) / depth
    y = (height - 1) / 2 - BELOW.focal * (points[:, 1] - b / 2) / depth
    return np.column_stack([x, y])


def at(z):
    return np.column_stack([POINTS, np.full(len(POINTS), z)])


def test_it_sees_points_where_the_pinhole_says_and_is_turned_and_not_mirrored():
    np.testing.assert_allclose(BELOW.project(at(-1.5)), by_hand(at(-1.5)), atol=1e-9)
    np.testing.assert_allclose(BELOW.on_plate(by_hand(at(-1.5)), -1.5), POINTS, atol=1e-9)
    assert np.linalg.det(BELOW.T_cam_plate[:3, :3]) == pytest.approx(1.0)
    assert BELOW.scale == pytest.approx(ABOVE.scale)


@pytest.mark.parametrize(
    ("camera", "face", "height"),
    [
        (ABOVE, "top", 1.5),
        (BELOW, "bottom", -1.5),
        (synthetic.telecentric_above(PLATE, SIZE), "top", 1.5),
        (synthetic.telecentric_below(PLATE, SIZE), "bottom", -1.5),
    ],
)
def test_a_camera_says_which_face_it_sees_and_how_high_that_is(camera, face, height):
    assert (camera.face, camera.face_height(THICKNESS)) == (face, height)
    assert synthetic.face_height(face, THICKNESS) == height


def test_a_plate_that_turns_with_the_clock_is_seen_to_turn_against_it():
    angle = 1e-3
    turned = np.zeros((len(POINTS), 3))
    turned[:, :2] = angle * (POINTS - np.array(PLATE) / 2) @ [[0, 1], [-1, 0]]
    for camera, sense in ((BELOW, 1.0), (ABOVE, -1.0)):
        z = camera.face_height(THICKNESS)
        ray = camera.project(at(z)) - camera.centre
        motion = synthetic.image_motion(camera, POINTS, turned, z)
        expected = sense * angle * ray @ [[0, 1], [-1, 0]]
        np.testing.assert_allclose(motion, expected, atol=1e-9)


def test_a_slope_moves_the_underside_the_other_way_and_a_press_brings_it_nearer():
    """W = s (x - x0): the face at z moves by -z s along x, so up the slope on the underside."""
    slope, lift = 2e-3, -0.4
    z, px = -THICKNESS / 2, by_hand(at(-THICKNESS / 2))
    seen = synthetic.image_motion_basis(
        BELOW, px, np.full((len(px), 1), lift), np.tile([slope, 0.0], (len(px), 1, 1)), z
    )[:, :, 0]
    moved = at(z) + np.array([-z * slope, 0.0, lift])
    assert moved[0, 0] > POINTS[0, 0]
    # Of first order in a lift of a thousandth of the distance.
    np.testing.assert_allclose(seen, by_hand(moved) - px, atol=3e-3 * np.abs(seen).max())


def test_the_image_is_that_of_a_camera_above_in_a_mirror():
    """Of a plate without thickness that moves in its plane alone, to the last pixel."""
    pattern = synthetic.speckle(PLATE, diameter=8.0, softness=0.6, seed=3)

    def stretched(xy):
        return np.column_stack([1e-3 * xy[:, 0], 2e-3 * xy[:, 1], np.zeros(len(xy))])

    below, above = (
        synthetic.render(pattern, camera, stretched, None, None) for camera in (BELOW, ABOVE)
    )
    np.testing.assert_allclose(below, above[:, ::-1], atol=1e-6)
    warper = synthetic.prepare_warp(pattern, BELOW)
    assert np.abs(warper.render(stretched(warper.points), None, None) - below).max() < 0.3


def test_a_camera_that_looks_away_from_its_face_is_refused():
    with pytest.raises(ValueError, match="side of the face that it watches"):
        BELOW.on_plate([[100.0, 100.0]], -500.0)

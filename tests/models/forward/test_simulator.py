"""What a camera makes of touches, without images."""

import numpy as np
import pytest

import fe
import synthetic
from models.forward.simulator import superpose, through_camera

PLATE = fe.Plate(size=(120.0, 90.0), thickness=1.0, young=3000.0, poisson=0.38, edges=fe.Clamped())
TOP = PLATE.thickness / 2
PLACES = np.array([[300.0, 280.0], [500.0, 700.0], [800.0, 200.0]])
TOUCH = np.array([[80.0, 60.0]])


@pytest.fixture(scope="module")
def modes():
    return fe.modes(PLATE, 400)


@pytest.mark.slow
def test_a_telecentric_camera_reads_the_strain_of_the_plate(modes):
    camera = synthetic.telecentric_above(PLATE.size, (1600, 1200))
    found = through_camera(modes, camera, synthetic.strain_gauges(PLACES))(TOUCH)[0]
    expected = fe.influence(PLATE, camera.on_plate(PLACES, TOP)).strain(TOUCH)[0]
    # Rows of an image run down, so that its shear has the other sign. Measured 2.2 % of the
    # largest, 4.1 with 150 modes and 1.0 with 800: the bend at a point is in no mode.
    assert np.abs(found - expected * [1, 1, -1]).max() < 0.03 * np.abs(expected).max()


def test_a_camera_in_perspective_reads_the_motion_towards_it_too(modes):
    camera = synthetic.pinhole_above(PLATE.size, 500.0, (1600, 1200))
    gauges = synthetic.strain_gauges(PLACES)
    found = through_camera(modes, camera, gauges)(TOUCH)[0]
    points = camera.on_plate(gauges.px, TOP)
    w = (modes.value(points) @ modes.response(TOUCH).T)[:, 0]
    slope = np.einsum("nka,k->na", modes.slope(points), modes.response(TOUCH)[0])
    small = 1e-4  # N: the camera is linear for small motions only
    moved = small * np.column_stack([-TOP * slope, w])
    exact = gauges.read(synthetic.image_motion(camera, points, moved, TOP)) / small
    np.testing.assert_allclose(found, exact, atol=1e-5 * np.abs(exact).max())


def test_touches_add_with_their_forces_through_a_camera(modes):
    unit = through_camera(
        modes, synthetic.pinhole_above(PLATE.size), synthetic.strain_gauges(PLACES)
    )
    touches = np.array([[[20.0, 30.0, 0.5], [80.0, 60.0, 2.0]]])
    expected = 0.5 * unit(touches[0, :1, :2]) + 2.0 * unit(touches[0, 1:, :2])
    np.testing.assert_allclose(superpose(unit)(touches), expected, rtol=1e-12)

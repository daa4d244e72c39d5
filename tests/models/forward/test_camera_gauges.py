"""What DIC reads at gauges through a camera, as a measurement of touches."""

import numpy as np
import pytest

import fe
import synthetic
from models.forward.camera_gauges import prepare_camera_gauges

SIZE = (120.0, 90.0)
PLACES = np.array([[30.0, 25.0], [40.0, 30.0], [70.0, 60.0], [95.0, 45.0]])


@pytest.fixture(scope="module")
def seen():
    plate = fe.Plate(SIZE, thickness=1.0, young=3000.0, poisson=0.3, edges=fe.Clamped())
    camera = synthetic.pinhole_above(SIZE, stand_off=300.0, pixels=(400, 320))
    return prepare_camera_gauges(fe.modes(plate, 60), camera, PLACES, subset=31)


@pytest.fixture(scope="module")
def image():
    return 100.0 + 40.0 * np.random.default_rng(0).standard_normal((320, 400))


def test_gauges_stand_where_the_camera_sees_their_places(seen):
    camera = synthetic.pinhole_above(SIZE, stand_off=300.0, pixels=(400, 320))
    px = camera.project(np.column_stack([PLACES, np.full(4, 0.5)]))
    assert np.abs(seen.gauges.xy - px).max() <= 0.5


def test_strain_of_a_touch_is_that_of_its_modes(seen):
    xy = np.array([[50.0, 40.0], [20.0, 70.0]])
    q = seen.modes.response(xy)
    expected = np.einsum("mck,nk->nmc", seen.of_modes, q)
    np.testing.assert_allclose(seen.strain(xy), expected)
    assert seen.strain(xy).shape == (2, 4, 3)


def test_white_numbers_hold_touches_and_noise_as_the_strains_do(seen, image):
    root = seen.root(image, 2.0)
    white = seen.white(root)
    np.testing.assert_allclose(
        white.whitening @ root @ root.T @ white.whitening.T, np.eye(12), atol=1e-9
    )
    strain = 2.5 * seen.strain(np.array([[50.0, 40.0]]))[0].ravel()
    predicted, _ = white.forward.read(np.array([[50.0, 40.0, 2.5]]))
    np.testing.assert_allclose(white.whitening @ strain, predicted, rtol=1e-6, atol=1e-9)
    exact = strain @ np.linalg.solve(root @ root.T, strain)
    assert predicted @ predicted == pytest.approx(exact, rel=1e-6)


def test_gauges_that_leave_the_image_are_refused():
    plate = fe.Plate(SIZE, thickness=1.0, young=3000.0, poisson=0.3, edges=fe.Clamped())
    camera = synthetic.pinhole_above(SIZE, stand_off=300.0, pixels=(400, 320))
    with pytest.raises(ValueError, match=r"gauges of 61 px must lie in the image.*margin"):
        prepare_camera_gauges(fe.modes(plate, 20), camera, np.array([[2.0, 45.0]]), subset=61)

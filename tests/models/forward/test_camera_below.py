"""Forward models of a camera under the plate: what the underside does, to second order."""

import numpy as np
import pytest

import fe
import models
import synthetic
from dic import lay_tiles

PLATE = fe.Plate((150.0, 110.0), 2.0, 3000.0, 0.38)
CAMERA = synthetic.pinhole_below(PLATE.size, 260.0, (320, 256))
TOUCH = fe.Touch(60.0, 70.0, 30.0)


@pytest.fixture(scope="module")
def modes():
    return fe.modes(PLATE, 60)


def motion_of(state, px):
    """Where what a pixel sees at rest goes under a state of the plate, px."""
    height = -0.5 * PLATE.thickness
    places = CAMERA.on_plate(px, height)
    at = np.column_stack([places, np.full(len(places), height)])
    return CAMERA.project(at + state.displacement(places, "bottom")) - px


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


def test_the_motion_of_the_tiles_is_that_of_the_underside(modes):
    """Of a deflected plate on its mesh, not of its modes; the face above moves otherwise."""
    tiles, state = lay_tiles((256, 320), 8), fe.Linear(PLATE, modes.mesh).deflect([TOUCH])
    motions = models.prepare_motions(modes, CAMERA, CAMERA.face_height(PLATE.thickness), tiles)
    amplitudes = np.zeros(motions.basis.shape[1])
    amplitudes[: modes.count] = TOUCH.force * modes.response(np.array([[TOUCH.x, TOUCH.y]]))[0]
    inner = np.abs(tiles.xy - np.array(CAMERA.size) / 2).max(axis=1) < 100
    came_from = tiles.xy[inner].copy()
    for _ in range(10):
        came_from -= came_from + motion_of(state, came_from) - tiles.xy[inner]
    truth = tiles.xy[inner] - came_from
    largest = np.abs(truth).max()
    assert largest > 0.1  # px
    # The sharp bend beside the touch is more than 60 modes and a tile show.
    assert rms(motions.flow(amplitudes)[inner] - truth) < 0.02 * rms(truth)
    wrong = models.prepare_motions(modes, CAMERA, 0.5 * PLATE.thickness, tiles)
    assert rms(wrong.flow(amplitudes)[inner] - truth) > 0.5 * rms(truth)


@pytest.mark.slow
def test_gauges_read_the_strain_of_the_underside(modes):
    """To what 60 modes leave out; a telecentric camera sees no change of distance beside it."""
    camera = synthetic.telecentric_below(PLATE.size, (1500, 1100), 0.0)
    places = np.array([[70.0, 55.0], [95.0, 60.0]])
    state = fe.Linear(PLATE, modes.mesh).deflect([TOUCH])
    gauges = models.prepare_camera_gauges(modes, camera, places, 21)
    read = TOUCH.force * gauges.strain(np.array([[TOUCH.x, TOUCH.y]]))[0]
    exx, eyy, exy = state.strain(places, "bottom").T
    # Both axes of the image run against those of the plate: the shear keeps its sign.
    np.testing.assert_allclose(read, np.column_stack([exx, eyy, exy]), atol=0.08 * exx.max())
    assert exx[0] > 0  # in tension under the finger


def test_a_plate_that_shifts_over_the_camera_is_seen_where_it_went():
    numbers = np.array([0.0, 0.0, 0.0, 1.0, -2.0, 3.0, 0.0, 0.0, 0.0])
    off = models.varied(CAMERA, (75.0, 55.0, 0.0), numbers)
    points = np.array([[20.0, 30.0, -1.0], [120.0, 80.0, -1.0]])
    np.testing.assert_allclose(off.project(points), CAMERA.project(points + numbers[3:6]))
    assert off.face == "bottom"

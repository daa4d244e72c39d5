"""The response of a bent plate to touches, against the whole shell on another mesh."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import fe

TWO = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())
PLATE = fe.Plate((100.0, 80.0), 1.0, 3000.0, 0.3, TWO)
SHELL = fe.Shell(PLATE, fe.Mesh(PLATE.size, (12, 10)))
FINER = fe.Shell(PLATE, fe.Mesh(PLATE.size, (16, 13)))
BASE = fe.Base(2.0, 1.0)
PLACE = np.array([[38.0, 27.0]])


@cache
def response():
    return fe.shell_response(SHELL.at(BASE), 90)


@cache
def points():
    xy = np.random.default_rng(2).uniform(3.0, [97.0, 77.0], (80, 2))
    return xy[np.hypot(*(xy - PLACE).T) > 8.0]


def pressed(force):
    state = FINER.at(BASE)
    touched = state.touch([fe.Touch(float(PLACE[0, 0]), float(PLACE[0, 1]), force)])
    return touched.displacement(points()) - state.displacement(points())


@pytest.mark.parametrize(("force", "off"), [(0.1, 0.01), (1.0, 0.01), (2.5, 0.015)])
def test_a_touch_moves_the_plate_as_the_whole_shell_does(force, off):
    truth = pressed(force)
    moved = response().motion(points()) @ response().amplitudes(PLACE, force)[0]
    assert np.linalg.norm(moved - truth) < off * np.linalg.norm(truth)


def test_what_is_not_linear_is_kept_and_stated():
    truth, tangent = pressed(2.5), response().gradient(PLACE, [0.0])[0, :, 2]
    linear = 2.5 * response().motion(points()) @ tangent
    off = np.linalg.norm(linear - truth) / np.linalg.norm(truth)
    assert off > 0.03
    assert response().nonlinearity(PLACE, [2.5])[0] == pytest.approx(off, rel=0.4)


def test_gradients_are_those_of_the_amplitudes():
    force, step = 1.3, 1e-4
    found = response().gradient(PLACE, [force])[0]
    for axis, way in enumerate(([[step, 0.0]], [[0.0, step]])):
        ahead, back = (response().amplitudes(PLACE + s * np.array(way), force) for s in (1, -1))
        np.testing.assert_allclose(found[:, axis], (ahead - back)[0] / (2 * step), atol=1e-5)
    ahead, back = (response().amplitudes(PLACE, force + s * step) for s in (1, -1))
    np.testing.assert_allclose(found[:, 2], (ahead - back)[0] / (2 * step), atol=1e-5)


def test_a_shape_changes_with_its_base_by_its_tangent():
    state = SHELL.at(BASE)
    motion = fe.face_motion(state, fe.base_tangent(state), points())
    for number, (less, more) in enumerate([((1.99, 1.0), (2.01, 1.0)), ((2.0, 0.99), (2.0, 1.01))]):
        there, here = (SHELL.moved(state, fe.Base(*base)) for base in (more, less))
        truth = (there.displacement(points()) - here.displacement(points())) / 0.02
        np.testing.assert_allclose(motion[:, :, number], truth, atol=2e-3)


def test_a_plate_that_found_no_rest_has_no_response():
    state = SHELL.at(BASE)
    lost = replace(state, stability=replace(state.stability, verdict=fe.Verdict.NOT_CONVERGED))
    with pytest.raises(ValueError, match="needs a stable equilibrium"):
        fe.shell_response(lost)

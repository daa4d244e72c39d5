"""Large touches: the solver on the reduced plate, from strain and from the whole pattern."""

import dataclasses

import numpy as np
import pytest

import fe
import models
import synthetic
from dic.tiles.preparation import prepare_tiles
from dic.tiles.tiles import tile_sums
from models import Result
from models.inverse import solver

PLATE = fe.Plate((110.0, 90.0), 1.0, 3000.0, 0.38)
RING = np.array([(x, y) for x in (8.0, 40.0, 70.0, 102.0) for y in (7.0, 45.0, 83.0)])
SIGMA = 1e-6  # strain; 8 N give 6e-4
ONE = np.array([[45.0, 52.0, 8.0]])  # bends by 0.9 thicknesses
TWO = np.array([[40.0, 52.0, 7.0], [78.0, 40.0, 9.0]])
NOISE = 2.0  # grey levels
SENSOR = synthetic.Sensor(noise=0.0, bits=16)  # 16 bits as 0 … 255: images without rounding


@pytest.fixture(scope="module")
def reduced():
    return fe.reduced_plate(PLATE, fe.Mesh(PLATE.size, (14, 12)), force=12.0)


@pytest.fixture(scope="module")
def gauges(reduced):
    return models.large_gauges(reduced, RING, SIGMA)


@pytest.fixture(scope="module")
def large(reduced):
    return models.large_plate(reduced, 42)


def found(estimate):
    return np.column_stack([estimate.xy, estimate.force])


def test_derivatives_are_those_of_the_measurement(gauges):
    jacobian = gauges.read(TWO)[1]
    for k in range(6):
        step = 1e-4 * np.eye(6)[k].reshape(2, 3)
        slope = (gauges.read(TWO + step)[0] - gauges.read(TWO - step)[0]) / 2e-4
        np.testing.assert_allclose(jacobian[k], slope, atol=2e-5 * np.abs(jacobian).max())


@pytest.mark.parametrize("touches", [ONE, TWO])
def test_strain_of_large_touches_gives_them_back(gauges, touches):
    search = models.prepare_candidates(gauges, 8)
    estimate = models.find(gauges.read(touches)[0], search, count=len(touches))
    np.testing.assert_allclose(found(estimate), touches, atol=1e-4)  # mm and N


def test_linear_theory_is_led_astray_by_large_touches(gauges, reduced):
    measured = gauges.read(ONE)[0]
    linear = models.gauge_forward(fe.influence(PLATE, RING, reduced.mesh), SIGMA)
    estimate = models.find(measured, models.prepare_candidates(linear), count=1)
    assert abs(estimate.force[0] - 8.0) > 1.0
    assert estimate.p_value < 1e-12


def test_light_touches_are_those_of_linear_theory(gauges, reduced):
    light = np.array([[45.0, 52.0, 1e-3]])
    linear = models.gauge_forward(fe.influence(PLATE, RING, reduced.mesh), SIGMA).read(light)
    for one, other in zip(gauges.read(light), linear, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-3 * np.abs(other).max())


def test_scatter_is_the_covariance_that_is_stated(gauges):
    gauges = dataclasses.replace(gauges, missed=0.0)  # of noise: what is measured is the model's
    search, rng, squares = models.prepare_candidates(gauges, 8), np.random.default_rng(1), []
    exact = gauges.read(ONE)[0]
    for _ in range(40):
        estimate = models.find(exact + rng.normal(size=exact.shape), search, start=ONE, count=1)
        error = (found(estimate) - ONE)[0]
        squares.append(error @ np.linalg.solve(estimate.covariance, error))
    assert np.mean(squares) == pytest.approx(3.0, abs=4 * np.sqrt(6 / 40))


def test_a_touch_beyond_what_was_reduced_says_so(gauges):
    assert gauges.trust(ONE) is fe.Trust.TRAINED
    assert gauges.trust(np.array([[50.0, 45.0, 60.0]])) is fe.Trust.BEYOND


def test_amplitudes_are_those_of_the_displacement(large, reduced):
    places = np.array([[30.0, 40.0], [47.0, 50.0], [80.0, 20.0]])
    amplitudes = large.amplitudes(TWO[:, :2], TWO[:, 2])
    state = reduced.solve([fe.Touch(*touch) for touch in TWO])
    moved = state.displacement(places, "middle")
    modal, plane = amplitudes[:42], amplitudes[42:]
    np.testing.assert_allclose(
        large.modes.value(places) @ modal, moved[:, 2], rtol=0.02
    )  # 42 modes
    in_plane = np.abs(moved[:, :2]).max()
    np.testing.assert_allclose(large.drift(places) @ plane, moved[:, :2], atol=0.3 * in_plane)


@pytest.mark.parametrize("touches", [ONE, TWO])
def test_large_touches_are_found_in_the_image(large, reduced, touches):
    camera = synthetic.pinhole_above(PLATE.size, 200.0, (320, 272))
    speckle = synthetic.speckle(PLATE.size, diameter=1.7, softness=0.6)
    warper = synthetic.prepare_warp(speckle, camera, PLATE.thickness / 2)
    still, bent = (
        warper.render(moved, SENSOR, None) / 257.0
        for moved in (
            np.zeros((len(warper.points), 3)),
            reduced.solve([fe.Touch(*touch) for touch in touches]).displacement(warper.points),
        )
    )
    reference = prepare_tiles(still, size=8)
    motions = models.prepare_motions(large.modes, camera, 0.5, reference.tiles, large)
    pattern = models.prepare_pattern(motions, reference)
    search, motion, start = (
        models.prepare_candidates(pattern.forward(NOISE), 8),
        pattern.still(),
        (),
    )
    for _ in range(4):
        right = pattern.gradient(tile_sums(reference, bent, motions.flow(motion)), motion)
        estimate = models.find(pattern.whiten(right, NOISE), search, start=start, max_touches=3)
        start, motion = found(estimate), pattern.amplitudes(estimate, right)
    assert (estimate.result, estimate.count) == (Result.FOUND, len(touches))
    np.testing.assert_allclose(estimate.xy, touches[:, :2], atol=0.3)  # mm
    np.testing.assert_allclose(estimate.force, touches[:, 2], rtol=0.02)


def test_what_the_reduced_plate_misses_grows_with_stretch_and_not_with_light_touches(large):
    white = np.random.default_rng(2).normal(size=(42 + large.drifts, 42 + large.drifts))
    light, firm = (large.forward(white).own_error(ONE * (1, 1, part)) for part in (1e-3, 1.0))
    assert light < 1e-5 * firm  # with the square of the deflection
    twice = large.forward(2.0 * white).own_error(ONE)  # half the noise
    assert twice == pytest.approx(2.0 * firm)


def test_an_error_of_the_model_widens_what_is_stated(gauges):
    """Errors that look like touches are drawn and added to exact measurements."""
    error, rng, squares, values = 12.0, np.random.default_rng(4), [], []

    class Erring:
        plate, freedom, model_error = PLATE, gauges.freedom, gauges.model_error
        read, response = staticmethod(gauges.read), staticmethod(gauges.response)

        @staticmethod
        def own_error(touches):
            return error

    search = models.with_forward(models.prepare_candidates(gauges, 8), Erring())
    exact, jacobian = gauges.read(ONE)
    alike = np.linalg.svd(jacobian, full_matrices=False)[2]  # what touches here would do
    even = error / np.sqrt(len(exact))
    for _ in range(60):
        measured = exact + even * np.sqrt(solver.ALIKE) * rng.normal(size=3) @ alike
        other = even * rng.normal(size=len(exact)) + rng.normal(size=len(exact))
        other -= (
            (other - rng.normal(size=len(exact))) @ alike.T @ alike
        )  # noise alone is left there
        estimate = models.find(measured + other, search, start=ONE, count=1)
        off = (found(estimate) - ONE)[0]
        squares.append(off @ np.linalg.solve(estimate.covariance, off))
        values.append(estimate.p_value)
    assert np.mean(squares) == pytest.approx(3.0, abs=4 * np.sqrt(6 / 60))
    assert np.median(values) == pytest.approx(0.5, abs=0.3)


@pytest.mark.slow
def test_touches_of_the_shell_lie_within_what_gauges_of_the_reduced_plate_state():
    plate = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
    ring = np.array([(x, y) for x in (9.0, 50.0, 100.0, 141.0) for y in (8.0, 101.0)])
    ring = np.concatenate([ring, [(9.0, 38.0), (9.0, 72.0), (141.0, 38.0), (141.0, 72.0)]])
    sigma, rng = 2e-7, np.random.default_rng(17)  # noise far below what is missed
    gauges = models.large_gauges(fe.reduced_plate(plate, force=8.0), ring, sigma)
    blind = dataclasses.replace(gauges, missed=0.0)
    searches = [models.prepare_candidates(each, 8) for each in (gauges, blind)]
    mesh, errors = fe.even_grid(plate, 40), [[], []]
    for count in (1, 2) * 6:
        xy = rng.uniform((25.0, 20.0), (125.0, 90.0), (count, 2))
        if count == 2:
            xy[1] = np.array(plate.size) - xy[0] + rng.uniform(-8.0, 8.0, 2)
        if count == 2 and np.hypot(*(xy[0] - xy[1])) < 30.0:
            continue
        touches = np.column_stack([xy, rng.uniform(3.0, 8.0, count)])
        touches = touches[np.lexsort((touches[:, 1], touches[:, 0]))]
        state = fe.solve(plate, [fe.Touch(*touch) for touch in touches.tolist()], mesh=mesh)
        measured = gauges.whiten(state.strain(ring)) + rng.normal(size=3 * len(ring))
        for search, off in zip(searches, errors, strict=True):
            estimate = models.find(measured, search, start=touches, count=count)
            scale = np.sqrt(np.diag(estimate.covariance))
            off += ((found(estimate) - touches).ravel() / scale).tolist()
    stated, unstated = (np.abs(off) for off in errors)
    assert 0.5 < np.mean(stated < 1.0) < 0.95
    assert np.mean(stated < 2.0) > 0.85
    assert np.mean(unstated < 2.0) < 0.6  # by noise alone


def test_what_gauges_miss_grows_with_stretch_and_is_theirs_in_units_of_noise(gauges, reduced):
    light, firm = (gauges.own_error(ONE * (1, 1, part)) for part in (1e-3, 1.0))
    assert 0 < light < 1e-5 * firm
    half = models.large_gauges(reduced, RING, SIGMA / 2)
    assert half.own_error(ONE) == pytest.approx(2.0 * firm)
    fewer = models.large_gauges(reduced, RING[:3], SIGMA)
    assert fewer.own_error(ONE) == pytest.approx(firm / 2.0)  # a quarter of the channels


def test_noise_must_be_positive(reduced):
    with pytest.raises(ValueError, match=r"^sigma of strain must be positive, got 0"):
        models.large_gauges(reduced, RING, 0.0)

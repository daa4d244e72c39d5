"""One touch by a net from strains: found, sure of itself, and none where nothing presses."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import fe
import synthetic
from models.data.dataset import Dataset, grid_places, random_places
from models.estimate import Result
from models.forward.camera_gauges import prepare_camera_gauges
from models.nets import net
from models.nets.net_estimator import NetTouchEstimator, jacobian, prepare_net_estimator
from models.nets.recipe import Recipe
from models.nets.train import train_net

pytest.importorskip("torch")

SIZE = (120.0, 90.0)
FORCE = 2.0


@pytest.fixture(scope="module")
def bench():
    """Return a net trained on the strains of gauges under a camera, and what it was trained for."""
    plate = fe.Plate(SIZE, thickness=1.0, young=3000.0, poisson=0.3, edges=fe.Clamped())
    camera = synthetic.pinhole_above(SIZE, stand_off=300.0, pixels=(400, 320))
    seen = prepare_camera_gauges(
        fe.modes(plate, 60), camera, grid_places(SIZE, 15.0, 15.0), subset=31
    )
    rng = np.random.default_rng(1)
    root = seen.root(100.0 + 40.0 * rng.standard_normal((320, 400)), 1.0)
    places = random_places(SIZE, 15.0, 1500, rng)
    clear = seen.strain(places).reshape(len(places), -1)
    training = Dataset(clear + rng.standard_normal(clear.shape) @ root.T / FORCE, places)
    recipe = Recipe(600, 5e-3, "cosine", "scaled", check=600)
    options = net.NetOptions((48, 48), "silu", "relative")
    made = train_net(training, training, options, recipe, rng).net
    return SimpleNamespace(
        seen=seen, root=root, net=made, around=random_places(SIZE, 20.0, 64, rng)
    )


def reported(bench, steps, force=FORCE, count=300):
    """Return estimates of touches of a force in noise, and the true places."""
    rng = np.random.default_rng(2)
    estimator = prepare_net_estimator(bench.net, bench.seen, bench.root, bench.around, steps)
    places = random_places(SIZE, 20.0, count, rng)
    clear = force * bench.seen.strain(places).reshape(count, -1)
    noise = rng.standard_normal(clear.shape) @ bench.root.T
    return [estimator.fit(each.reshape(-1, 3)) for each in clear + noise], places


@pytest.mark.parametrize("steps", [0, 2])
def test_the_stated_covariance_holds(bench, steps):
    """Inside one sigma: measured 0.65 to 0.72 of x, y and F, with two steps 0.66 to 0.70."""
    estimates, places = reported(bench, steps)
    assert all(each.count == 1 for each in estimates)
    found = np.array([[*each.xy[0], each.force[0]] for each in estimates])
    sigma = np.sqrt([np.diag(each.covariance) for each in estimates])
    off = np.abs(found - np.column_stack([places, np.full(len(places), FORCE)])) / sigma
    inside = (off < 1.0).mean(axis=0)
    assert ((inside > 0.60) & (inside < 0.85)).all(), inside


def test_steps_of_the_solver_bring_the_touch_nearer(bench):
    rms = {}
    for steps in (0, 2):
        estimates, places = reported(bench, steps)
        off = np.array([each.xy[0] for each in estimates]) - places
        rms[steps] = np.sqrt(np.mean(np.sum(off**2, axis=1)))
    assert rms[2] < rms[0]


@pytest.mark.parametrize("steps", [0, 2])
def test_noise_alone_is_no_touch(bench, steps):
    estimates, _ = reported(bench, steps, force=0.0)
    assert [each.result for each in estimates] == [Result.NO_TOUCH] * len(estimates)


@pytest.mark.parametrize("steps", [0, 2])
def test_a_net_that_points_off_the_plate_reports_no_touch(bench, steps):
    """Its place is put on the clamped edge, where no touch strains the plate."""
    *hidden, (weights, biases) = bench.net.layers
    wrong = replace(bench.net, layers=(*hidden, (weights, biases + 1e4)))
    estimator = prepare_net_estimator(wrong, bench.seen, bench.root, bench.around, steps)
    strain = FORCE * bench.seen.strain(np.array([[50.0, 40.0]]))[0]
    assert estimator.fit(strain).result is Result.NO_TOUCH


def test_the_strains_fit_where_the_net_is_a_little_off(bench):
    """χ² leaves out what a small move of the touch explains."""
    estimates, _ = reported(bench, steps=0)
    assert np.median([each.p_value for each in estimates]) > 0.1


def test_the_error_of_the_net_is_that_without_noise_around_the_touch(bench):
    quiet = 1e-6 * bench.root
    estimator = prepare_net_estimator(bench.net, bench.seen, quiet, bench.around)
    off = net.predict(bench.net, bench.seen.strain(bench.around).reshape(64, -1)) - bench.around
    here = bench.around[5]
    near = off[np.argsort(np.linalg.norm(bench.around - here, axis=1))[:9]]
    reported = estimator.fit(FORCE * bench.seen.strain(here[None])[0])
    np.testing.assert_allclose(reported.covariance[:2, :2], near.T @ near / 9, rtol=0.5)


def test_the_jacobian_says_how_the_estimate_moves(bench):
    strain = bench.seen.strain(np.array([[50.0, 40.0]])).ravel()
    rng = np.random.default_rng(0)
    small = 1e-3 * np.abs(strain).mean() * rng.standard_normal(len(strain))
    moved = net.predict(bench.net, strain + small) - net.predict(bench.net, strain)
    np.testing.assert_allclose(jacobian(bench.net, strain) @ small, moved[0], rtol=0.05, atol=1e-4)


def test_the_force_of_a_touch_leaves_a_relative_net_alone(bench):
    strain = bench.seen.strain(np.array([[50.0, 40.0], [80.0, 30.0]])).reshape(2, -1)
    np.testing.assert_allclose(net.predict(bench.net, 7.0 * strain), net.predict(bench.net, strain))
    assert np.isfinite(net.predict(bench.net, 0.0 * strain)).all()


def test_a_net_of_two_touches_is_refused(bench):
    layers = net.initial((bench.seen.of_modes.shape[0] * 3, 4), np.random.default_rng(0))
    pair = net.Net(net.NetOptions(()), bench.net.scaling, layers)
    with pytest.raises(ValueError, match="x and y of one touch, got 4 numbers; train one without"):
        prepare_net_estimator(pair, bench.seen, bench.root, bench.around)


def test_it_is_plain_data(bench):
    estimator = prepare_net_estimator(bench.net, bench.seen, bench.root, bench.around)
    assert isinstance(estimator, NetTouchEstimator)
    assert estimator.steps == 0

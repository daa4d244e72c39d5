"""Extreme touches are right or said not to be: force, edges, coincidence, single precision."""

import numpy as np
import pytest

import fe
import models
from models.data.gauge_layout import gauges_inside_edges

PLATE = fe.Plate((120.0, 100.0), 1.0, 3000.0, 0.38)
INFLUENCE = fe.influence(PLATE, gauges_inside_edges(PLATE.size), fe.Mesh(PLATE.size, (48, 40)))
SIGMA = 1e-7  # strain; 1 N leaves 1e-4


def strain(touches):
    touches = np.array(touches, dtype=float)
    return np.einsum("n,nmc->mc", touches[:, 2], INFLUENCE.strain(touches[:, :2]))


def solve(touches, **known):
    noise = np.random.default_rng(1).normal(0, SIGMA, (len(INFLUENCE.gauges), 3))
    return models.solve(strain(touches) + noise, INFLUENCE, SIGMA, **known)


@pytest.mark.parametrize("force", 10.0 ** np.arange(-2, 5))
def test_forces_over_six_decades_are_found_to_the_noise(force):
    estimate = solve([(40.0, 61.0, force)])
    assert estimate.result is models.Result.FOUND
    off = np.array([*estimate.xy[0] - (40.0, 61.0), estimate.force[0] - force])
    assert (np.abs(off) < 4 * np.sqrt(np.diag(estimate.covariance))).all()


def test_a_touch_too_weak_for_the_noise_is_not_found():
    assert solve([(40.0, 61.0, 1e-5)]).result is models.Result.NO_TOUCH


@pytest.mark.parametrize("ratio", [1e2, 1e4, 1e6])
def test_a_strong_touch_does_not_hide_a_weak_one(ratio):
    estimate = solve([(40.0, 61.0, 1.0), (85.0, 30.0, ratio)])
    np.testing.assert_allclose(estimate.xy, [(40.0, 61.0), (85.0, 30.0)], atol=0.1)  # mm
    np.testing.assert_allclose(estimate.force, [1.0, ratio], rtol=0.01)


@pytest.mark.parametrize(
    "place", [(50.0, 0.3), (0.3, 50.0), (119.7, 40.0), (0.3, 0.3), (119.8, 99.8)]
)
def test_a_touch_that_the_edge_holds_back_is_not_said_to_be_found(place):
    assert solve([(*place, 20.0)]).result is not models.Result.FOUND


@pytest.mark.parametrize("place", [(50.0, 3.0), (4.0, 50.0), (116.0, 96.0)])
def test_a_touch_near_an_edge_or_corner_is_found(place):
    estimate = solve([(*place, 20.0)])
    assert estimate.result is models.Result.FOUND
    np.testing.assert_allclose(estimate.xy, [place], atol=0.1)  # mm


def test_touches_that_coincide_are_one_of_both_forces():
    estimate = solve([(40.0, 61.0, 3.0), (40.0, 61.0, 2.0)])
    assert estimate.result is models.Result.FOUND
    np.testing.assert_allclose(estimate.xy, [(40.0, 61.0)], atol=0.02)  # mm
    np.testing.assert_allclose(estimate.force, [5.0], rtol=1e-3)


def test_two_that_are_asked_for_where_both_coincide_are_unresolvable():
    estimate = solve([(40.0, 61.0, 3.0), (40.0, 61.0, 2.0)], count=2)
    assert estimate.result is models.Result.UNRESOLVABLE


def test_strain_in_single_precision_moves_nothing_by_more_than_the_noise():
    measured = strain([(40.0, 61.0, 3.0), (85.0, 30.0, 2.0)])
    double, single = (
        models.solve(measured.astype(kind), INFLUENCE, SIGMA) for kind in (np.float64, np.float32)
    )
    sigma = np.sqrt(np.diag(double.covariance)).reshape(-1, 3)
    assert (np.abs(single.xy - double.xy) < 0.05 * sigma[:, :2]).all()
    assert (np.abs(single.force - double.force) < 0.05 * sigma[:, 2]).all()


@pytest.mark.parametrize("apart", [2.0, 3.0, 5.0])
def test_touches_close_together_are_right_or_reported_as_such(apart):
    # Noise at which the valley between the two is curved: 5 % were found far off, and believed.
    touches = np.array([(50.0, 60.0, 3.0), (50.0 + apart, 60.0, 2.0)])
    rng, middle = np.random.default_rng(2), 0.6 * touches[0, 0] + 0.4 * touches[1, 0]
    for _ in range(60):
        noise = rng.normal(0, 8 * SIGMA, (len(INFLUENCE.gauges), 3))
        estimate = models.solve(strain(touches) + noise, INFLUENCE, 8 * SIGMA)
        if estimate.result is models.Result.FOUND:
            truth = touches if estimate.count == 2 else np.array([(middle, 60.0, 5.0)])
            off = np.column_stack([estimate.xy, estimate.force]) - truth
            assert (np.abs(off).ravel() < 5 * np.sqrt(np.diag(estimate.covariance)) + 0.05).all()

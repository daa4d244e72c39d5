"""Friction widens places by what it turns the plate, and forces by nothing."""

import numpy as np
import pytest

import fe
import models

ANGLE = np.linspace(0, 2 * np.pi, 24, endpoint=False)
GAUGES = np.column_stack([75 + 55 * np.cos(ANGLE), 50 + 35 * np.sin(ANGLE)])
SIGMA = 1e-6
TOUCHES = np.array([[50.0, 62.0, 2.0], [105.0, 33.0, 1.5]])


def plate(thickness=1.0, patches=()):
    return fe.Plate((150.0, 100.0), thickness, 3000.0, 0.38, patches=patches)


def found(on, friction):
    influence = fe.influence(on, GAUGES)
    strain = sum(F * influence.strain([(x, y)])[0] for x, y, F in TOUCHES)
    forward = models.gauge_forward(influence, SIGMA)
    return models.Estimator(forward, friction=friction).fit(strain)


@pytest.mark.slow
def test_places_are_uncertain_by_half_the_thickness_under_each_touch():
    thicker = fe.Patch((80.0, 150.0), (0.0, 100.0), 1.6, 3000.0)
    straight, rubbed = (found(plate(patches=(thicker,)), each) for each in (0.0, 0.25))
    np.testing.assert_array_equal(rubbed.xy, straight.xy)
    added = np.diag([0.125, 0.125, 0.0, 0.2, 0.2, 0.0]) ** 2
    np.testing.assert_allclose(rubbed.covariance - straight.covariance, added, atol=1e-12)
    np.testing.assert_allclose(rubbed.systematic, added, atol=1e-12)  # no mean makes it smaller
    assert straight.systematic is None


@pytest.fixture(scope="module")
def forward():
    return models.gauge_forward(fe.influence(plate(), GAUGES), SIGMA)


def test_a_plate_that_nothing_touches_has_no_friction(forward):
    empty = models.Estimator(forward, friction=0.2).fit(np.zeros((24, 3)))
    assert empty.count == 0
    assert empty.covariance.shape == (0, 0)


@pytest.mark.parametrize("wrong", [-0.1, np.nan, np.inf])
def test_no_coefficient_is_refused(forward, wrong):
    with pytest.raises(ValueError, match="friction must be a finite number of 0 or more"):
        models.Estimator(forward, friction=wrong)


def test_the_error_by_friction_is_that_of_two_directions():
    assert models.friction_error(plate(2.0), 0.2) == pytest.approx(np.hypot(0.2, 0.2))

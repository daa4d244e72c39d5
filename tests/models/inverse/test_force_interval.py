"""The interval of a force that is not known evenly holds it as often as it says, on both sides."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, least_squares

import fe
import models
from models import Result

PLATE = fe.Plate((150.0, 100.0), 1.0, 3000.0, 0.38)
X, Y = np.meshgrid(np.linspace(45.0, 105.0, 8), np.linspace(35.0, 65.0, 5))
INFLUENCE = fe.influence(
    PLATE, np.column_stack([X.ravel(), Y.ravel()]), fe.Mesh(PLATE.size, (30, 20))
)
SIGMA = 1e-6  # strain
ESTIMATOR = models.Estimator(models.gauge_forward(INFLUENCE, SIGMA))


def strain(touches):
    touches = np.asarray(touches, dtype=float).reshape(-1, 3)
    return np.einsum("n,nmc->mc", touches[:, 2], INFLUENCE.strain(touches[:, :2]))


def measure(touches, rng):
    """Strain with noise, in units of the noise, (3M,)."""
    noisy = strain(touches) + SIGMA * rng.standard_normal((X.size, 3))
    return ESTIMATOR.forward.whiten(noisy)


def estimated(measured, count=None):
    found = ESTIMATOR.fit_whitened(measured, count=count)
    return ESTIMATOR.with_force_intervals(found, measured)


def scanned(measured, estimate, rise, side):
    """Bound of a force by brute force: the best place for each force, by another optimiser."""

    def left(xy, force):
        return measured - strain([[*xy, force]]).ravel() / SIGMA

    place, lowest = estimate.xy[0], np.square(left(estimate.xy[0], estimate.force[0])).sum()

    def above(force):
        nonlocal place
        best = least_squares(left, place, args=(force,), diff_step=1e-5)
        place = best.x
        return 2.0 * best.cost - lowest - rise

    far = estimate.force[0]
    while above(far) < 0:
        far *= 1.1**side
    return brentq(above, far / 1.1**side, far, xtol=1e-3)


def test_bounds_are_where_chi2_rises_whatever_the_place():
    measured = measure([(9.0, 40.0, 2.5)], np.random.default_rng(3))
    estimate = estimated(measured, 1)
    (interval,) = estimate.force_intervals
    for rise, bounds in ((1.0, interval.level_68), (4.0, interval.level_95)):
        expected = [scanned(measured, estimate, rise, side) for side in (-1, 1)]
        np.testing.assert_allclose(bounds, expected, rtol=5e-3)


class Counting(models.LinearForward):
    """A forward model that counts how often it is read."""

    reads = 0

    def read(self, touches):
        Counting.reads += 1
        return super().read(touches)


def test_an_interval_takes_few_readings_of_the_forward_model():
    forward, counts = models.gauge_forward(INFLUENCE, SIGMA), []
    counting = models.Estimator(
        Counting(**{name: getattr(forward, name) for name in forward.__dataclass_fields__})
    )
    rng = np.random.default_rng(11)
    for _ in range(20):
        touch = rng.uniform(8.0, 14.0), rng.uniform(30.0, 70.0), rng.uniform(1.0, 3.0)
        measured = measure([touch], rng)
        found, Counting.reads = estimated(measured, 1), 0
        (interval,) = counting.with_force_intervals(found, measured).force_intervals
        assert np.isfinite([interval.level_68, interval.level_95]).all()
        counts.append(Counting.reads)
    assert np.mean(counts) < 6.0  # one about the touch, and two for each side


def test_the_interval_near_an_edge_is_missed_as_often_on_either_side():
    rng, force, bounds, evenly = np.random.default_rng(5), [], [], []
    for _ in range(300):
        touch = rng.uniform(6.0, 9.0), rng.uniform(30.0, 70.0), rng.uniform(0.5, 1.5)
        estimate = estimated(measure([touch], rng), 1)
        sigma = np.sqrt(estimate.covariance[2, 2])
        force.append(touch[2])
        bounds.append(estimate.force_intervals[0].level_95)
        evenly.append(estimate.force[0] + 2.0 * sigma)
    low, high = np.transpose(bounds)
    # 2.3 % of 300: 0.9 % is a standard deviation
    assert np.mean(np.array(force) < low) < 0.05
    assert np.mean(np.array(force) > high) < 0.05
    assert np.mean(np.array(force) > evenly) > 0.08


def test_a_force_that_no_chi2_bounds_has_no_upper_bound():
    rng = np.random.default_rng(0)
    for _ in range(20):
        estimate = estimated(measure([(4.0, 50.0, 1.0)], rng), 1)
        (interval,) = estimate.force_intervals
        low, high = interval.level_95
        assert estimate.result is Result.UNRESOLVABLE
        assert 0 <= low < estimate.force[0] < high
    weak = estimated(measure([(3.0, 50.0, 0.3)], np.random.default_rng(1)), 1)
    assert weak.force_intervals[0].level_95[1] == np.inf


def test_a_force_that_may_be_none_is_bounded_by_none():
    measured = measure([(75.0, 50.0, 2e-4)], np.random.default_rng(2))
    found = ESTIMATOR.fit_whitened(measured, count=1)
    (interval,) = ESTIMATOR.with_force_intervals(found, measured).force_intervals
    assert measured @ measured - found.chi2 < 4.0
    assert interval.level_95[0] == 0.0


def test_only_touches_that_need_one_have_an_interval():
    rng = np.random.default_rng(7)
    measured = measure([(14.0, 50.0, 3.0), (90.0, 50.0, 2.0)], rng)
    edge, middle = estimated(measured).force_intervals
    assert middle is None
    assert edge.level_95[0] < edge.level_68[0] < 3.3
    assert edge.level_68[1] < edge.level_95[1]
    assert ESTIMATOR.fit_whitened(measured).force_intervals == ()


def test_the_other_touch_gives_way_while_a_force_is_bounded():
    """The other force is as free as the place: the interval is wider than with it held."""
    rng = np.random.default_rng(8)
    measured = measure([(14.0, 40.0, 3.0), (30.0, 60.0, 2.0)], rng)
    both = estimated(measured, 2)
    other = both.force[1] * INFLUENCE.strain(both.xy[1:])[0].ravel() / SIGMA
    alone = estimated(measured - other, 1)
    wide, narrow = (np.ptp(one.force_intervals[0].level_95) for one in (both, alone))
    assert wide > narrow


def test_a_model_that_errs_widens_the_interval_as_it_does_the_covariance():
    class Erring(models.LinearForward):
        def own_error(self, touches):
            return 2.0 * np.sqrt(3 * X.size)

    forward = models.gauge_forward(INFLUENCE, SIGMA)
    erring = models.Estimator(
        Erring(**{name: getattr(forward, name) for name in forward.__dataclass_fields__})
    )
    measured = measure([(14.0, 50.0, 3.0)], np.random.default_rng(9))
    found = estimated(measured, 1)
    wide = erring.with_force_intervals(found, measured).force_intervals[0]
    assert np.ptp(wide.level_68) > 2.0 * np.ptp(found.force_intervals[0].level_68)


@pytest.mark.parametrize("count", [0, 1])
def test_no_touch_has_no_interval(count):
    measured = measure(np.empty((0, 3)), np.random.default_rng(count))
    found = replace(ESTIMATOR.fit_whitened(measured), force_intervals=())
    assert ESTIMATOR.with_force_intervals(found, measured).force_intervals == ()

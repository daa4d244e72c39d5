"""What is not known of a bench, as errors of touches: against closed forms and the linear plate."""

import numpy as np
import pytest

import fe
import models

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
NAMES = [name for name, _ in models.BENCH]
NOISE = 2e-3  # of an amplitude, mm²
LIGHT = np.array([[40.0, 60.0, 1e-2], [90.0, 45.0, 1e-2]])
FIRM = np.array([[40.0, 60.0, 3.0], [90.0, 45.0, 1.5]])
LABEL = np.array([0.2, 0.2, 0.003])


@pytest.fixture(scope="module")
def forward(modal_bench):
    return modal_bench(PLATE, NOISE)


@pytest.fixture
def bench():
    return models.bench_before(PLATE)


def exactly_known(bench):
    nothing = np.zeros_like(bench.covariance)
    return models.BenchEstimate(bench.values, nothing, 0.0, bench.prior, memory=0.0)


def test_a_light_touch_is_off_by_the_cube_of_the_thickness_and_by_the_modulus(forward, bench):
    for name, power in (("thickness", 3.0), ("young", 1.0)):
        off = models.cost_of(forward, bench, (name,), LIGHT)
        sigma = bench.prior[NAMES.index(name)]
        np.testing.assert_allclose(off.force / LIGHT[:, 2], power * sigma, rtol=2e-3)
        assert off.place.max() < 1e-2  # they change how far a plate gives, not where


def test_the_modulus_never_moves_a_touch(forward, bench):
    off = models.cost_of(forward, bench, ("young",), FIRM)
    assert off.place.max() < 1e-6  # mm: bending and stretching are both in proportion to it


def test_numbers_that_are_independent_add_their_variances(forward, bench):
    names = ("thickness", "tension_xx", "sag")
    each = [models.cost_of(forward, bench, (name,), FIRM) for name in names]
    both = models.cost_of(forward, bench, names, FIRM)
    np.testing.assert_allclose(both.place**2, sum(one.place**2 for one in each))
    np.testing.assert_allclose(both.force**2, sum(one.force**2 for one in each))


def test_a_bench_that_is_known_leaves_the_noise(forward, bench):
    exact = models.errors_on_bench(forward, exactly_known(bench), FIRM)
    bound = models.expected_errors(forward, FIRM)
    np.testing.assert_allclose(exact.place, bound.place)
    np.testing.assert_allclose(exact.force, bound.force)
    usual = models.errors_on_bench(forward, bench, FIRM)
    assert (usual.place > bound.place).all()
    assert (usual.force > bound.force).all()


def test_presses_are_added_as_information(forward, bench):
    """The filter's covariance is that of all presses in one system of normal equations."""
    free = np.flatnonzero(bench.prior > 0)
    known = models.bench_after(forward, bench, FIRM, LABEL, 0.3)
    normal = np.diag(bench.prior[free] ** -2.0)
    for press in FIRM:
        seen, own = forward.read(press[None])
        even = 0.3**2 + bench.discrepancy**2 * float(seen @ seen) / len(seen)
        # Place and force as further unknowns, with the list as their prior.
        rows = np.concatenate([forward.by_bench(press[None])[free], own])
        whole = rows @ rows.T / even
        whole[-3:, -3:] += np.diag((LABEL * [1.0, 1.0, press[2]]) ** -2.0)
        inside, across, beside = whole[:-3, :-3], whole[:-3, -3:], whole[-3:, -3:]
        normal += inside - across @ np.linalg.solve(beside, across.T)
    sigma = np.sqrt(np.diag(np.linalg.inv(normal)))
    np.testing.assert_allclose(known.sigma[free], sigma, rtol=1e-3)
    assert (known.sigma <= bench.sigma * (1 + 1e-9)).all()

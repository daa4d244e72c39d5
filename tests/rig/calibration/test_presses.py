"""Known presses correct gains, places and stiffness: as good as a model that was right at once."""

import numpy as np
import pytest

import fe
import models
from models.data import gauge_layout
from rig.calibration.presses import fit_presses
from rig.live.alignment import align

PLATE = fe.Plate((120.0, 90.0), 1.0, 3000.0, 0.3, fe.Clamped())
GAUGES = gauge_layout.gauges_inside_edges((120.0, 90.0), 15.0, 15.0)
MESH = fe.grid(PLATE, 40)
SIGMA = 0.5e-6  # strain; a press of 2 N gives 20 µε here


@pytest.fixture(scope="module")
def assumed():
    return fe.influence(PLATE, GAUGES, MESH)


class Real:
    """The plate as it is: 10 % softer, gauges off by 0.5 mm and 2 %."""

    def __init__(self):
        rng = np.random.default_rng(11)
        self.shift = rng.normal(0, 0.5, GAUGES.shape)
        self.gain = 1 + rng.normal(0, 0.02, len(GAUGES))
        real = fe.influence(PLATE, GAUGES + self.shift, MESH)
        values = real.adjoint.values * np.repeat(1.1 * self.gain, 3)
        self.influence = fe.Influence(fe.Adjoint(PLATE, MESH, values), GAUGES)

    def read(self, touches, rng):
        unit = self.influence.strain(touches[:, :2]) * touches[:, 2, None, None]
        return unit + rng.normal(0, SIGMA, unit.shape)


@pytest.fixture(scope="module")
def real():
    return Real()


def draw(count, rng):
    inner = rng.uniform((30, 30), (90, 60), (count, 2))
    return np.column_stack([inner, rng.uniform(1.5, 3.0, count)])


def rms(influence, touches, strain):
    """RMS distance and force error, mm and N, of one touch each."""
    found = [models.solve(s, influence, sigma=SIGMA, count=1) for s in strain]
    places = np.array([estimate.xy[0] for estimate in found])
    forces = np.array([estimate.force[0] for estimate in found])
    away = np.linalg.norm(places - touches[:, :2], axis=1)
    return np.sqrt(np.mean(away**2)), np.sqrt(np.mean((forces - touches[:, 2]) ** 2))


@pytest.mark.slow
def test_twenty_presses_bring_the_error_within_1_2_of_the_perfect_model(assumed, real, rng):
    known = draw(20, rng)
    presses = tuple(fe.Touch(*touch) for touch in known.tolist())
    fitted = fit_presses(presses, real.read(known, rng), assumed, SIGMA)
    touches = draw(200, rng)
    strain = real.read(touches, rng)
    perfect, before, after = (
        rms(influence, touches, strain) for influence in (real.influence, assumed, fitted.influence)
    )
    assert before[0] > 2 * perfect[0]
    assert before[1] > 2 * perfect[1]
    assert after[0] < 1.2 * perfect[0]
    assert after[1] < 1.2 * perfect[1]


def test_what_is_fitted_is_true_within_its_own_uncertainty(assumed, real, rng):
    known = draw(20, rng)
    presses = tuple(fe.Touch(*touch) for touch in known.tolist())
    fitted = fit_presses(presses, real.read(known, rng), assumed, SIGMA)
    assert fitted.softness == pytest.approx(1.1, abs=0.02)
    gain = (fitted.gain * fitted.softness - 1.1 * real.gain) / (fitted.sigma_gain * 1.1)
    shift = (fitted.shift - real.shift) / fitted.sigma_shift
    assert 0.7 < np.std(gain) < 1.3
    assert 0.7 < np.std(shift) < 1.3
    assert fitted.chi2 / fitted.dof == pytest.approx(1.0, abs=0.15)


def test_too_few_presses_and_other_gauges_are_refused(assumed):
    press = fe.Touch(50.0, 40.0, 1.0)
    with pytest.raises(ValueError, match="need 5 known presses or more, got 1"):
        fit_presses((press,), np.zeros((1, len(GAUGES), 3)), assumed, SIGMA)
    with pytest.raises(ValueError, match=r"must be \(5, "):
        fit_presses((press,) * 5, np.zeros((5, 3, 3)), assumed, SIGMA)


def pressed(rng, count=20, noise=0.3):
    """Presses, and what a bench finds that is turned, shifted and too soft; one was a slip."""
    true = np.column_stack([rng.uniform((20, 20), (230, 180), (count, 2)), np.full(count, 2.0)])
    turn = np.array([[1.01, 0.004], [-0.006, 0.985]])
    found = true.copy()
    found[:, :2] = true[:, :2] @ turn.T + (1.5, -0.8) + rng.normal(0, noise, (count, 2))
    found[:, 2] = true[:, 2] / 1.1 * (1 + rng.normal(0, 0.02, count))
    sigma = np.tile((noise, noise, 0.04), (count, 1))
    return tuple(fe.Touch(*row) for row in true.tolist()), found, sigma


def test_an_alignment_takes_out_what_is_affine_and_states_what_is_left(rng):
    errors = []
    for _ in range(20):
        corrected = align(*pressed(rng))
        fresh, again, _ = pressed(rng, 200)
        true = np.array([(press.x, press.y) for press in fresh])
        places = again[:, :2] @ corrected.matrix[:, :2].T + corrected.matrix[:, 2]
        errors.append(np.sqrt(np.mean(np.square(places - true).sum(1))) / corrected.error)
        assert corrected.gain == pytest.approx(1.1, abs=4.5 * corrected.sigma_gain)
        assert not corrected.slips or len(corrected.slips) < 3
    assert np.mean(errors) == pytest.approx(1.0, abs=0.1)


def uneven(rng, shift=(0.0, 0.0), gain=1.0, finger=0.0, common=0.0, count=20):
    """Presses on a bench without other faults; those near an edge are eight times less sure.

    Errors of the reference are a fraction `common` of the noise and the same in all.
    """
    true = np.column_stack([rng.uniform((20, 20), (230, 180), (count, 2)), np.full(count, 2.0)])
    sigma = np.exp(rng.uniform(np.log(0.25), np.log(2.0), (count, 1))) * (1.0, 0.7, 0.05)
    found = true - (*shift, 0.0) + rng.normal(0, 0.5, (count, 3)) * sigma  # means of four frames
    found += common * rng.normal(size=3) * sigma
    found[:, :2] += rng.normal(0, finger, (count, 2))
    found[:, 2] /= gain
    return tuple(fe.Touch(*row) for row in true.tolist()), found, sigma


@pytest.mark.parametrize(("finger", "common"), [(0.0, 0.0), (1.0, 0.0), (0.0, 0.24)])
def test_a_bench_that_is_right_is_left_alone(rng, finger, common):
    drawn = [align(*uneven(rng, finger=finger, common=common)) for _ in range(200)]
    assert (
        np.mean([bool(corrected.terms) for corrected in drawn]) < 0.03
    )  # of 4 tests at 0.2 % each
    alone = next(corrected for corrected in drawn if not corrected.terms)
    np.testing.assert_array_equal(alone.matrix, np.eye(2, 3))
    assert alone.gain == 1.0


def test_what_is_off_is_corrected_with_no_more_terms_than_it_has(rng):
    for _ in range(20):
        corrected = align(*uneven(rng, shift=(0.8, -0.5), gain=1.1))
        assert corrected.terms == ("shift", "force")
        middle = corrected.correct(np.array([[125.0, 100.0, 1.0]]))[0] - (125.0, 100.0, 0.0)
        np.testing.assert_allclose(middle[:2], (0.8, -0.5), atol=0.3)
        assert middle[2] == pytest.approx(1.1, abs=4.5 * corrected.sigma_gain)


def test_a_press_without_a_stated_noise_is_refused(rng):
    presses, found, sigma = uneven(rng)
    with pytest.raises(ValueError, match="sigma of a press must be positive, got 0; state"):
        align(presses, found, 0 * sigma)


def test_a_slip_is_left_out_and_named(rng):
    presses, found, sigma = pressed(rng)
    found[7, :2] += (25.0, -10.0)
    corrected = align(presses, found, sigma)
    assert 7 in corrected.slips
    assert corrected.error < 0.7


def test_an_alignment_of_an_estimate_turns_its_covariance_too(rng):
    corrected = align(*pressed(rng, noise=1e-9))
    spread = np.diag([0.4, 0.1, 0.02]) ** 2
    estimate = models.Estimate(
        np.array([[50.0, 60.0]]), np.array([2.0]), spread, 1.0, 1, 0.5, models.Result.FOUND
    )
    after = corrected.apply(estimate)
    draws = rng.multivariate_normal([50.0, 60.0], spread[:2, :2], 4000)
    mapped = draws @ corrected.matrix[:, :2].T + corrected.matrix[:, 2]
    np.testing.assert_allclose(after.xy[0], mapped.mean(0), atol=0.05)
    np.testing.assert_allclose(after.covariance[:2, :2], np.cov(mapped.T), atol=0.01)
    assert after.force[0] == pytest.approx(2.0 * corrected.gain)


def test_presses_on_a_line_are_refused():
    presses = tuple(fe.Touch(10.0 * k, 5.0 * k, 1.0) for k in range(1, 9))
    found = np.array([(press.x, press.y, press.force) for press in presses])
    with pytest.raises(ValueError, match="lie on one line; spread them over the plate"):
        align(presses, found, np.ones((8, 3)))

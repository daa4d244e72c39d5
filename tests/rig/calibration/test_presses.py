"""Known presses mend gains, places and stiffness: as good as a model that was right at once."""

import numpy as np
import pytest

import fe
import models
from models import ring
from rig.calibration.alignment import align
from rig.calibration.presses import fit_presses

PLATE = fe.Plate((120.0, 90.0), 1.0, 3000.0, 0.3, fe.Clamped())
GAUGES = ring.inside_edges((120.0, 90.0), 15.0, 15.0)
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
    return tuple(fe.Touch(*row) for row in true.tolist()), found


def test_an_alignment_takes_out_what_is_affine_and_states_what_is_left(rng):
    errors = []
    for _ in range(20):
        presses, found = pressed(rng)
        mended = align(presses, found)
        fresh, again = pressed(rng, 200)
        true = np.array([(press.x, press.y) for press in fresh])
        places = again[:, :2] @ mended.matrix[:, :2].T + mended.matrix[:, 2]
        errors.append(np.sqrt(np.mean(np.square(places - true).sum(1))) / mended.error)
        assert mended.gain == pytest.approx(1.1, abs=4.5 * mended.sigma_gain)
        assert not mended.slips or len(mended.slips) < 3
    assert np.mean(errors) == pytest.approx(1.0, abs=0.1)


def test_a_slip_is_left_out_and_named(rng):
    presses, found = pressed(rng)
    found[7, :2] += (25.0, -10.0)
    mended = align(presses, found)
    assert 7 in mended.slips
    assert mended.error < 0.7


def test_an_alignment_of_an_estimate_turns_its_covariance_too(rng):
    mended = align(*pressed(rng, noise=1e-9))
    spread = np.diag([0.4, 0.1, 0.02]) ** 2
    estimate = models.Estimate(
        np.array([[50.0, 60.0]]), np.array([2.0]), spread, 1.0, 1, 0.5, models.Result.FOUND
    )
    after = mended.apply(estimate)
    draws = rng.multivariate_normal([50.0, 60.0], spread[:2, :2], 4000)
    mapped = draws @ mended.matrix[:, :2].T + mended.matrix[:, 2]
    np.testing.assert_allclose(after.xy[0], mapped.mean(0), atol=0.05)
    np.testing.assert_allclose(after.covariance[:2, :2], np.cov(mapped.T), atol=0.01)
    assert after.force[0] == pytest.approx(2.0 * mended.gain)


def test_presses_on_a_line_are_refused():
    presses = tuple(fe.Touch(10.0 * k, 5.0 * k, 1.0) for k in range(1, 9))
    found = np.array([(press.x, press.y, press.force) for press in presses])
    with pytest.raises(ValueError, match="lie on one line; spread them over the plate"):
        align(presses, found)

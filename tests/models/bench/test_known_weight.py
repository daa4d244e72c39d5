"""A known weight sets the newton; the truth is a whole plate of another theory's mesh."""

import numpy as np
import pytest

import fe
import models

PLATE = fe.Plate((150.0, 110.0), 2.0, 3000.0, 0.38)
NAMES = [name for name, _ in models.BENCH]
YOUNG = NAMES.index("young")
SOFTER = 0.066
NOISE = 4e-3  # of an amplitude, mm²
FRAMES = 8
MODES = 24  # that are measured
WEIGHT = 2.0


@pytest.fixture(scope="module")
def forward():
    modal = fe.modal_plate(PLATE, 40, fe.grid(PLATE, 18))
    fields = models.BenchFields(fe.BenchPlate(modal, fe.bench_values()))
    return models.BenchForward(fields, np.eye(MODES, fields.count + fields.drifts) / NOISE)


@pytest.fixture(scope="module")
def truth():
    """Give what a plate that is softer shows, solved on its own mesh and read at points."""
    true = fe.Plate(PLATE.size, 2.0, (1.0 - SOFTER) * PLATE.young, PLATE.poisson)
    x, y = (side * (np.arange(n) + 0.5) / n for side, n in zip(PLATE.size, (45, 33), strict=True))
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return fe.WholePlate(true, fe.grid(true, 30), points)


@pytest.fixture(scope="module")
def measure(forward, truth):
    """Give the products of the true deflection with the first modes, in units of their noise."""
    shapes = forward.fields.value(truth.points)[:, :MODES] * PLATE.area / len(truth.points)

    def seen(touch, rng):
        deflection = truth.pressed([fe.Touch(*touch)])[:, 2]
        return deflection @ shapes / NOISE + rng.standard_normal(MODES) / np.sqrt(FRAMES)

    return seen


def learned(forward, measure, bench, touches, rng, weight=None):
    for touch in touches:
        sigma, start = np.full(3, np.inf), touch + rng.normal(0.0, [1.0, 1.0, 0.02])
        if weight is not None:
            start[2], sigma[2] = weight, 3e-3 * weight
        press = models.Press(measure(touch, rng), start, sigma, 1.0 / np.sqrt(FRAMES))
        bench = models.learn(forward, bench, press)
        assert bench is not None
    return bench


def forces(forward, measure, bench, rng):
    """Find touches on what is known of the bench; error of each force as a fraction."""
    estimator = models.Estimator(forward.moved(bench.values), bench=bench)
    off, sigma = [], []
    for touch in ((60.0, 50.0, 1.5), (100.0, 70.0, 3.0), (50.0, 75.0, 2.5)):
        found = estimator.fit_whitened(measure(touch, rng), np.array([touch]), count=1)
        off.append(found.force[0] / touch[2] - 1.0)
        sigma.append(np.sqrt(found.covariance[2, 2]) / touch[2])
    return np.array(off), np.array(sigma)


@pytest.mark.slow
def test_one_weight_anywhere_corrects_all_forces(forward, measure):
    rng = np.random.default_rng(1)
    known = models.BenchEstimate(*_known(("young",)))
    places = rng.uniform([30.0, 25.0], [120.0, 85.0], (3, 2))
    ordinary = np.column_stack([places, rng.uniform(1.0, 3.0, 3)])
    before = learned(forward, measure, known, ordinary, rng)
    middle = np.array([75.0, 55.0, WEIGHT])
    off, sigma = forces(forward, measure, before, rng)
    assert np.median(off) == pytest.approx(1.0 / (1.0 - SOFTER) - 1.0, abs=0.02)
    assert models.force_sigma(forward, before, middle) > 0.05
    weight = np.array([[90.0, 40.0, WEIGHT]])
    after = learned(forward, measure, before, weight, rng, WEIGHT)
    off, sigma = forces(forward, measure, after, rng)
    assert np.abs(off).max() < 0.01
    assert (np.abs(off) < 4.0 * sigma).all()
    assert models.force_sigma(forward, after, middle) < 0.01


def _known(unsure):
    """Values, covariance, discrepancy and prior of a bench of which some is not known."""
    prior = models.bench_before(PLATE)
    part = np.array([1.0 if name in unsure else 0.02 for name in NAMES])
    return prior.values, np.diag((part * prior.prior) ** 2), 1e-2, prior.prior

"""A bench learned on from touches of which nothing is known; the modal plate is the truth here."""

import numpy as np
import pytest

import fe
import models

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
NAMES = [name for name, _ in models.BENCH]
TENSION = [NAMES.index("tension_xx"), NAMES.index("tension_yy")]
NOISE = 2e-3  # of an amplitude, mm²
FRAMES = 10


@pytest.fixture(scope="module")
def forward(modal_bench):
    return modal_bench(PLATE, NOISE)


@pytest.fixture(scope="module")
def before():
    """Give a bench that presses have shown well, but for what has happened since."""
    prior = models.bench_before(PLATE)
    return models.BenchEstimate(
        prior.values, 0.02**2 * prior.covariance, 1e-3, prior.prior, memory=0.0
    )


def touched(forward, values, rng):
    touch = np.array([*rng.uniform(25.0, [125.0, 85.0]), rng.uniform(1.0, 4.0)])
    seen = forward.on(values, None).read(touch[None])[0]
    seen = seen + rng.standard_normal(len(seen)) / np.sqrt(FRAMES)
    start = touch + rng.normal(0.0, [1.0, 1.0, 0.02])
    return models.Press(seen, start, np.full(3, np.inf), 1.0 / np.sqrt(FRAMES))


def test_a_plate_that_warms_is_followed(forward, before):
    rng, values, known = np.random.default_rng(2), np.zeros(len(NAMES)), before
    off, within = [], []
    for minute in range(1, 11):
        values[TENSION] = -0.03 * minute  # N/mm, a tenth of a kelvin a minute
        known = models.learn(forward, models.wandered(known, 60.0), touched(forward, values, rng))
        off.append(known.values[TENSION] - values[TENSION])
        within.append(off[-1] / known.sigma[TENSION])
    assert np.abs(off[3:]).max() < 0.01
    assert np.sqrt(np.mean(np.square(within))) < 1.5


def test_a_bench_as_it_was_stays_and_is_surer(forward, before):
    rng, known = np.random.default_rng(3), before
    for _ in range(5):
        known = models.learn(forward, known, touched(forward, np.zeros(len(NAMES)), rng))
    off = (known.values - before.values) / np.where(before.sigma > 0, before.sigma, 1.0)
    assert np.abs(off).max() < 3.0
    assert (known.sigma <= before.sigma * (1 + 1e-6)).all()
    assert known.sigma[TENSION].max() < 0.7 * before.sigma[TENSION].max()


def test_what_fits_no_likely_bench_says_nothing(forward, before):
    rng = np.random.default_rng(4)
    press = touched(forward, np.zeros(len(NAMES)), rng)
    strange = press.measured + rng.normal(0.0, 5.0, len(press.measured))
    wrong = models.Press(strange, press.touch, press.sigma, press.noise)
    assert models.learn(forward, before, wrong) is None


def test_edges_do_not_come_to_push(forward, before):
    rng, values = np.random.default_rng(5), np.zeros(len(NAMES))
    values[TENSION] = -0.3
    known = models.wandered(before, 300.0)
    for _ in range(4):
        known = models.learn(forward, known, touched(forward, values, rng))
    for k, name in enumerate(NAMES):
        if f"{name}_slope" in NAMES:
            assert known.values[k] - abs(known.values[k + 1]) > -0.1 * known.prior[k], name


def test_in_the_end_nothing_is_known_but_the_prior(before):
    hours = before
    for _ in range(2000):
        hours = models.wandered(hours, 60.0)
    assert (hours.sigma <= before.prior * (1 + 1e-9)).all()
    np.testing.assert_allclose(hours.sigma[TENSION], before.prior[TENSION], rtol=1e-2)


def test_time_does_not_run_backwards(before):
    with pytest.raises(ValueError, match=r"negative, got -1 s; give frames in their order"):
        models.wandered(before, -1.0)


@pytest.mark.slow
def test_a_touch_on_a_plate_far_from_its_scene_is_one_touch():
    """A plate that tension has half buckled gives twice as much: no line reaches there."""
    plate = fe.Plate((254.0, 203.0), 1.0, 3000.0, 0.38)
    fields = models.BenchFields(
        fe.BenchPlate(fe.modal_plate(plate, 50, fe.grid(plate, 20)), fe.bench_values())
    )
    forward = models.BenchForward(fields, np.eye(fields.count + fields.drifts) / (10 * NOISE))
    rng, values, before = np.random.default_rng(4), np.zeros(len(NAMES)), models.bench_before(plate)
    values[TENSION] = -1.2 * before.sigma[TENSION]
    estimator = models.Estimator(forward, max_touches=2, bench=before)
    for _ in range(8):
        touch = np.array([*rng.uniform(25.0, [229.0, 178.0]), rng.uniform(2.0, 4.0)])
        seen = forward.on(values, None).read(touch[None])[0]
        found = estimator.fit_whitened(seen + rng.standard_normal(len(seen)))
        assert found.count == 1
        assert found.result is models.Result.FOUND
        off = np.array([*found.xy[0], found.force[0]]) - touch
        assert (np.abs(off) < 3.0 * np.sqrt(np.diag(found.covariance))).all()

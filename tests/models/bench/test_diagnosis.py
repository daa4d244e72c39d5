"""Causes by name: one thing wrong at a time, touches of unknown place and force."""

from dataclasses import replace

import numpy as np
import pytest

import fe
import models

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
NOISE = 2e-3  # of an amplitude, mm²
NAMES = [name for name, _ in models.BENCH]


@pytest.fixture(scope="module")
def forward(modal_bench):
    return modal_bench(PLATE, NOISE)


def touched(forward, seed=3, own=0.002, alike=0.0, **wrong):
    """Eight touches on a bench of which something is wrong, of which nothing is known.

    The model errs by `own` of what a touch shows anew, by `alike` as for all others.
    """
    rng, values = np.random.default_rng(seed), np.zeros(len(NAMES))
    for name, value in wrong.items():
        values[NAMES.index(name)] = value
    on, made = forward.on(values, None), []
    shared = alike * rng.standard_normal(len(forward.whitening))
    for _ in range(8):
        touch = np.array([rng.uniform(25, 125), rng.uniform(25, 85), rng.uniform(1, 4)])
        seen = on.read(touch[None])[0]
        error = own * rng.standard_normal(len(seen)) + shared
        error *= np.linalg.norm(seen) / np.sqrt(len(seen))
        seen = seen + rng.standard_normal(len(seen)) + error
        made.append(models.Press(seen, touch + rng.normal(0, [2.0, 2.0, 0.2]), np.full(3, np.inf)))
    return made


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wrong", "cause"),
    [
        ({"membrane_west": 0.02, "membrane_north": 0.02}, "clamps that give"),
        ({"sag": 0.2}, "a plate that is not flat"),
        ({"tension_xx": 0.3, "tension_yy": 0.3}, "tension in the plate"),
    ],
)
def test_the_cause_is_named(forward, wrong, cause):
    found = models.diagnose(forward, touched(forward, **wrong), models.bench_before(PLATE))
    assert cause in [each.name for each in found.named]
    assert found.causes[0].name == cause
    assert cause in found.sentence
    assert "calibrate the bench" in found.sentence


def test_a_right_bench_is_not_accused(forward):
    steps = []
    prior = models.bench_before(PLATE)
    found = models.diagnose(
        forward, touched(forward), prior, progress=lambda done, total: steps.append((done, total))
    )
    assert found.named == ()
    assert "as the scene says" in found.sentence
    assert steps[-1] == (5, 5), "a camera that is not given is not accused"


@pytest.mark.slow
def test_a_right_bench_has_a_large_p_value_and_a_wrong_one_a_small_one(forward):
    prior = models.bench_before(PLATE)
    right = models.diagnose(forward, touched(forward, seed=5), prior)
    wrong = models.diagnose(forward, touched(forward, seed=5, sag=0.2), prior)
    assert right.p_value > models.FALSE_ALARM
    assert wrong.p_value < 1e-6
    shared = [
        replace(one, noise=np.sqrt(0.75), reference=0.5)
        for one in touched(forward, seed=5, sag=0.2)
    ]
    alike = models.diagnose(forward, shared, prior)
    assert alike.p_value > wrong.p_value, "noise that all touches share accuses less"


@pytest.mark.slow
def test_what_touches_of_unknown_force_cannot_tell_is_not_named(forward):
    prior = models.bench_before(PLATE)
    assert not models.diagnose(forward, touched(forward, young=0.2), prior).named
    uneven = models.diagnose(forward, touched(forward, thickness_x=0.08), prior)
    assert "uneven thickness" in [each.name for each in uneven.named]


@pytest.mark.slow
def test_right_benches_have_the_stated_p_values(forward):
    prior = models.bench_before(PLATE)
    error = prior.discrepancy
    drawn = [touched(forward, seed, own=error, alike=error) for seed in range(150)]
    found = [models.diagnose(forward, each, prior) for each in drawn]
    p_values = np.array([cause.p_value for each in found for cause in each.causes])
    assert sum(bool(each.named) for each in found) <= 1
    assert 0.6 < np.mean(p_values < 0.2) / 0.2 < 1.3
    assert 0.6 < np.mean(p_values < 0.05) / 0.05 < 1.6


def calibrated(values=(), sigma=0.02):
    """Give a bench of which presses have shown some values, and how well in parts of the prior."""
    prior = models.bench_before(PLATE)
    found = prior.values.copy()
    for name, value in dict(values).items():
        found[NAMES.index(name)] = value
    return replace(prior, values=found, covariance=sigma**2 * prior.covariance)


TENSE = {"tension_xx": 0.2, "tension_yy": 0.2}


@pytest.mark.slow
def test_what_has_changed_since_a_calibration_is_named(forward):
    known = calibrated(TENSE)
    same = models.diagnose(forward, touched(forward, **TENSE), known)
    assert same.named == ()
    assert same.sentence == "The bench is as calibrated, as far as these touches tell."
    sagged = models.diagnose(forward, touched(forward, **TENSE, sag=0.2), known)
    assert sagged.causes[0].name == "a plate that is not flat"
    assert sagged.sentence.startswith("Not as calibrated: a plate that is not flat (+0.2 mm of sag")
    assert models.diagnose(forward, touched(forward, **TENSE), models.bench_before(PLATE)).named


@pytest.mark.slow
def test_a_clamp_is_named_by_its_edge(forward):
    loose = touched(forward, membrane_west=0.02, membrane_north=0.02)
    found = models.diagnose(forward, loose, models.bench_before(PLATE))
    assert "the clamp at y = 110 mm gives in the plane, more by what" in found.sentence


@pytest.mark.slow
def test_what_a_calibration_is_not_sure_of_accuses_nothing(forward):
    presses = touched(forward, sag=0.08)
    assert models.diagnose(forward, presses, calibrated(sigma=1e-3)).named
    assert not models.diagnose(forward, presses, calibrated(sigma=0.6)).named


def test_touches_that_nothing_of_the_bench_explains_are_said_to_be_that(forward):
    rng = np.random.default_rng(8)
    behind = [
        replace(press, measured=press.measured + 9.0 * rng.standard_normal(press.measured.shape))
        for press in touched(forward)
    ]
    found = models.diagnose(forward, behind, models.bench_before(PLATE))
    assert not found.explained
    assert "touches are other than the theory has them" in found.sentence or found.named

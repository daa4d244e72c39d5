"""Some numbers of a bench found, while the others are not as described either."""

from dataclasses import replace

import numpy as np
import pytest

import fe
import models
from models.bench.identify import considered
from rig.calibration.bench_refusal import require_sound
from rig.commands.bench_table import described

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
NAMES = [name for name, _ in models.BENCH]
ASKED = (
    "young", "thickness", "sag", "tension_xx", "tension_yy",
    "membrane_west", "membrane_east", "membrane_south", "membrane_north",
)  # fmt: skip
FREED = np.array([name in ASKED for name in NAMES])
EVEN = [k for k, name in enumerate(NAMES) if f"{name}_slope" in NAMES]
PLACES = [(x, y) for x in (35.0, 75.0, 115.0) for y in (30.0, 55.0, 80.0)]


@pytest.fixture(scope="module")
def forward(modal_bench):
    return modal_bench(PLATE, 2e-3)


def drawn_bench(seed):
    """Draw all that a plate may have from its prior; edges only give, and all along."""
    rng, plate = np.random.default_rng(seed), len(fe.BENCH_PARAMETERS)
    drawn = rng.normal(0.0, models.prior_sigma(PLATE)[:plate])
    drawn[EVEN] = np.abs(drawn[EVEN])
    drawn[[k + 1 for k in EVEN]] = rng.uniform(-0.7, 0.7, 8) * drawn[EVEN]
    return np.concatenate([drawn, np.zeros(len(models.CAMERA))])


def presses(forward, true, places, seed):
    rng, sigma, on = np.random.default_rng(seed), np.array([0.1, 0.1, 0.01]), forward.on(true, None)
    made = []
    for x, y in places:
        touch = np.array([x, y, rng.uniform(1.0, 4.0)])
        seen = on.read(touch[None])[0]
        measured = seen + rng.standard_normal(len(seen))
        made.append(models.Press(measured, touch + rng.normal(0.0, sigma), sigma))
    return made


def errors(found, true):
    return np.abs(found.values - true)[FREED] / found.sigma[FREED]


def partly(forward, seed, places):
    """Find nine numbers of a drawn bench from a few presses; with the truth."""
    true = drawn_bench(seed)
    made = presses(forward, true, places, seed)
    return models.identify(forward, made, models.bench_before(PLATE), None, ASKED), true


@pytest.fixture(scope="module")
def few(forward):
    return partly(forward, 2, PLACES[::4])


def test_three_presses_say_no_more_than_they_know(few):
    off = errors(*few)
    assert off.max() < 4.0
    assert np.mean(off < 2.0) > 0.6


@pytest.mark.slow
@pytest.mark.parametrize("places", [PLACES[::4], PLACES])
def test_what_is_asked_for_is_within_its_sigma_while_all_else_is_off(forward, places):
    off = np.concatenate([errors(*partly(forward, seed, places)) for seed in range(20, 50)])
    assert off.max() < 4.5
    assert 0.6 < np.mean(off < 1.0) < 0.8
    assert np.mean(off < 2.0) > 0.9


def test_what_was_not_asked_for_stays_as_it_was(few):
    prior, (found, _) = models.bench_before(PLATE), few
    assert not found.values[~FREED].any()
    np.testing.assert_allclose(found.sigma[~FREED], prior.sigma[~FREED], rtol=1e-9)
    assert found.is_sound
    assert found.shown.values[~FREED].any()
    correlated = found.covariance[np.ix_(FREED, ~FREED)]
    assert np.abs(correlated).max() > 0.0, "what is found hangs on what is not"


def test_what_was_not_asked_for_and_is_otherwise_is_named(few):
    found, _ = few
    named = {one.cause for one in models.otherwise(found)}
    assert "uneven thickness" in named
    assert "the thickness" not in named
    said = described(found, ["a", "b", "c"], PLATE.size)
    caution = next(each for each in said["cautions"] if "not asked for" in each)
    assert "uneven thickness (thickness_" in caution
    assert "name them with --free too" in caution


def test_of_numbers_that_are_all_asked_for_none_is_otherwise(forward):
    made = presses(forward, drawn_bench(5), PLACES[::4], 5)
    found = models.identify(forward, made, models.bench_before(PLATE))
    assert found.shown is None
    assert models.otherwise(found) == ()


def test_a_bench_right_but_for_what_is_asked_for_accuses_nothing(forward):
    true = np.zeros(len(NAMES))
    true[NAMES.index("sag")] = 0.2
    made = presses(forward, true, PLACES[::2], 2)
    found = models.identify(forward, made, models.bench_before(PLATE), None, ASKED)
    assert models.otherwise(found) == ()
    assert found["sag"][0] == pytest.approx(0.2, abs=3 * found["sag"][1])


def test_a_number_that_nobody_asked_for_and_no_bench_has_is_refused(few):
    found, _ = few
    wrong = found.shown.values.copy()
    wrong[NAMES.index("tension_xy")] = 9.0 * found.prior[NAMES.index("tension_xy")]
    bench = replace(found, shown=replace(found.shown, values=wrong))
    with pytest.raises(ValueError, match=r"a bench with tension_xy = .* 9 times as far"):
        require_sound(bench, PLATE.size)


def test_a_covariance_that_is_none_is_refused(few):
    found, _ = few
    wrong = np.diag(found.prior**2) * np.where(np.arange(len(NAMES)) == 3, -0.1, 0.1)
    with pytest.raises(ValueError, match="did not converge"):
        require_sound(replace(found, shown=replace(found.shown, covariance=wrong)), PLATE.size)


@pytest.mark.slow
def test_held_out_presses_are_as_far_off_as_the_bench_that_is_kept_has_them(forward):
    """The others stay at their prior: a press on the bench as kept is less well known."""
    true, prior = drawn_bench(7), models.bench_before(PLATE)
    made = presses(forward, true, PLACES[::2], 7)
    found = models.identify(forward, made, prior, None, ASKED)
    off = []
    for k, press in enumerate(made):
        others = models.identify(forward, made[:k] + made[k + 1 :], prior, None, ASKED)
        bench = models.Estimator(forward, bench=others, max_touches=1)
        touch = bench.fit_whitened(press.measured, press.touch[None], count=1)
        off.append(np.hypot(*(touch.xy[0] - press.touch[:2])))
    assert found.held_out.place == pytest.approx(np.sqrt(np.mean(np.square(off))), rel=0.5)


def test_the_considered_covariance_is_that_of_a_linear_schmidt_filter():
    """Against the filter itself: a gain of optimal rows for what is asked for, and of none else."""
    rng = np.random.default_rng(11)
    size, seen = 7, rng.normal(size=(4, 7))
    root = rng.normal(size=(size, size))
    prior, asked = root @ root.T, np.arange(size) < 3
    gain = prior @ seen.T @ np.linalg.inv(seen @ prior @ seen.T + np.eye(4))
    found = (np.eye(size) - gain @ seen) @ prior
    gain[~asked] = 0.0
    kept = np.eye(size) - gain @ seen
    filtered = kept @ prior @ kept.T + gain @ gain.T
    np.testing.assert_allclose(considered(found, prior, asked), filtered, rtol=1e-8, atol=1e-8)


def test_what_presses_leave_less_sure_than_before_stays_so():
    rng = np.random.default_rng(12)
    root = rng.normal(size=(6, 6))
    found, prior, asked = root @ root.T, np.eye(6), np.arange(6) < 2
    covariance = considered(found, prior, asked)
    assert np.linalg.eigvalsh(covariance)[0] > -1e-9
    assert np.linalg.eigvalsh(covariance[2:, 2:] - found[2:, 2:])[0] > -1e-9
    assert np.linalg.eigvalsh(covariance[2:, 2:] - prior[2:, 2:])[0] > -1e-9

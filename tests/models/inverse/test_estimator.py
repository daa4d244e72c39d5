"""An estimator is prepared once, and says of every frame what a fresh one would say."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp

import fe
import models

PLATE = fe.Plate((150.0, 100.0), 1.0, 3000.0, 0.38)
ANGLE = np.linspace(0, 2 * np.pi, 24, endpoint=False)
GAUGES = np.column_stack([75 + 55 * np.cos(ANGLE), 50 + 35 * np.sin(ANGLE)])
INFLUENCE = fe.influence(PLATE, GAUGES)
SIGMA = 1e-6
FORWARD = models.gauge_forward(INFLUENCE, SIGMA)
ESTIMATOR = models.Estimator(FORWARD)


def strain(touches, rng):
    return sum(F * INFLUENCE.strain([(x, y)])[0] for x, y, F in touches) + rng.normal(
        0, SIGMA, (24, 3)
    )


def touches_of(estimate):
    return np.column_stack([estimate.xy, estimate.force])


@pytest.mark.parametrize("seed", range(4))
def test_a_prepared_estimator_says_what_solve_says(seed):
    rng = np.random.default_rng(seed)
    truth = np.column_stack([rng.uniform(20, 130, 2), rng.uniform(20, 80, 2), rng.uniform(1, 4, 2)])
    measured = strain(truth, rng)
    prepared, afresh = ESTIMATOR.fit(measured), models.solve(measured, INFLUENCE, SIGMA)
    np.testing.assert_array_equal(touches_of(prepared), touches_of(afresh))
    assert prepared.stats == afresh.stats
    one = models.Estimator(FORWARD, max_touches=1).fit(measured)
    assert one.count == 1


def test_a_start_saves_steps_and_changes_nothing():
    rng = np.random.default_rng(5)
    truth = [(50.0, 62.0, 2.0), (105.0, 33.0, 1.5)]
    measured = strain(truth, rng)
    cold = ESTIMATOR.fit(measured)
    tracked = ESTIMATOR.fit(measured, touches_of(cold))
    np.testing.assert_allclose(touches_of(tracked), touches_of(cold), atol=1e-3)
    assert 0 < tracked.stats.steps < cold.stats.steps
    assert tracked.stats.descents < cold.stats.descents
    assert tracked.stats.descents <= tracked.stats.evaluations
    assert cold.stats.converged


def test_stats_of_nothing_are_nothing():
    stats = ESTIMATOR.fit(np.zeros((24, 3))).stats
    assert stats == models.SolverStats(0, 0, 0, True)


def test_a_missing_channel_belongs_to_the_forward_model():
    rng = np.random.default_rng(6)
    missing = np.zeros((24, 3), dtype=bool)
    missing[3, 1] = missing[7] = True
    measured = np.where(missing, np.nan, strain([(60.0, 40.0, 2.0)], rng))
    partial = models.Estimator(models.gauge_forward(INFLUENCE, SIGMA, missing)).fit(measured)
    np.testing.assert_array_equal(
        touches_of(partial), touches_of(models.solve(measured, INFLUENCE, SIGMA))
    )
    with pytest.raises(ValueError, match="leave missing channels out"):
        ESTIMATOR.fit(measured)


def test_candidates_that_are_known_are_not_made_again():
    other = models.gauge_forward(INFLUENCE, 2 * SIGMA)
    grid = models.with_forward(ESTIMATOR.candidates, other)
    again = replace(ESTIMATOR, forward=other, grid=grid)
    assert again.candidates is grid
    assert replace(ESTIMATOR, forward=other).candidates is not ESTIMATOR.candidates
    np.testing.assert_array_equal(
        replace(ESTIMATOR, forward=other).candidates.response, grid.response
    )


@pytest.mark.parametrize(
    "solver",
    [
        models.LevenbergMarquardt(damping=1e-2, damping_down=0.5, damping_up=2.0),
        models.LevenbergMarquardt(tolerance=1e-9, max_steps=1000),
    ],
)
def test_another_solver_finds_the_same_touches(solver):
    measured = strain([(60.0, 40.0, 2.0)], np.random.default_rng(7))
    estimate = models.Estimator(FORWARD, solver=solver).fit(measured)
    np.testing.assert_allclose(touches_of(estimate), touches_of(ESTIMATOR.fit(measured)), atol=1e-3)


def test_fields_of_the_solver_reach_the_loop():
    measured = strain([(60.0, 40.0, 2.0)], np.random.default_rng(8))
    start = [(75.0, 55.0, 1.0)]

    def steps(**fields):
        solver = models.LevenbergMarquardt(**fields)
        return models.Estimator(FORWARD, solver=solver).fit(measured, start, count=1).stats.steps

    usual = steps()
    assert steps(damping=100.0) > usual
    assert steps(tolerance=10.0) < usual
    assert steps(damping=1.0, damping_down=0.9) > steps(damping=1.0, damping_down=0.1)
    stopped = models.LevenbergMarquardt(max_steps=1)
    stats = models.Estimator(FORWARD, solver=stopped).fit(measured, start, count=1).stats
    assert stats.steps == stats.descents


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"max_steps": 0}, "^max_steps must be a whole number of 1 or more, got 0"),
        ({"max_steps": 2.5}, "^max_steps must be a whole number of 1 or more, got 2.5"),
        ({"damping": 0.0}, "^damping must be a finite number above 0, got 0.0"),
        ({"damping_down": 1.0}, "^damping_down must be a finite number above 0 and below 1, got"),
        ({"damping_up": 1.0}, "^damping_up must be a finite number above 1, got 1.0"),
        ({"max_damping": np.inf}, "^max_damping must be a finite number above 1, got inf"),
        ({"tolerance": "x"}, "^tolerance must be a finite number above 0 of χ², got a str"),
    ],
)
def test_a_solver_that_could_not_end_is_refused(fields, sentence):
    with pytest.raises(ValueError, match=sentence):
        models.LevenbergMarquardt(**fields)


ANY_ARRAY = st.one_of(
    st.sampled_from(["1", None, [[1, 2], [3]], b"x", {}, np.float32(2), True, 3 + 2j, object()]),
    hnp.arrays(
        st.sampled_from([np.float64, np.float32, np.int64, np.bool_, np.complex128, "U3", object]),
        hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
    ),
    hnp.arrays(np.float64, (24, 3), elements=st.sampled_from([0.0, 1e-5, -3e-6, np.nan, 1e300])),
)
ANY_NUMBER = st.one_of(
    st.none(), st.integers(-2, 2), st.floats(), st.booleans(), st.sampled_from(["2", [1], 1j])
)


DOORS = {
    "fit": lambda a, b, n, m: ESTIMATOR.fit(a, count=n),
    "start": lambda a, b, n, m: ESTIMATOR.fit(np.zeros((24, 3)), a),
    "whitened": lambda a, b, n, m: ESTIMATOR.fit_whitened(a, b),
    "estimator": lambda a, b, n, m: models.Estimator(FORWARD, max_touches=n),
    "solve": lambda a, b, n, m: models.solve(a, INFLUENCE, SIGMA, n, m),
    "sigma": lambda a, b, n, m: models.gauge_forward(INFLUENCE, a),
    "covariance": lambda a, b, n, m: models.gauge_forward(INFLUENCE, covariance=a),
    "missing": lambda a, b, n, m: models.gauge_forward(INFLUENCE, SIGMA, a),
    "robust": lambda a, b, n, m: models.find_robust(a, ESTIMATOR.candidates, count=n),
    "candidates": lambda a, b, n, m: models.prepare_candidates(FORWARD, n),
    "prior": lambda a, b, n, m: models.prior((1.0, 2.0), n, m, n),
    "prior place": lambda a, b, n, m: models.prior(a, 1.0),
    "solver": lambda a, b, n, m: models.LevenbergMarquardt(max_steps=n, tolerance=m),
}


@pytest.mark.parametrize("door", DOORS)
@settings(max_examples=40)
@given(ANY_ARRAY, ANY_ARRAY, ANY_NUMBER, ANY_NUMBER)
def test_whatever_is_given_is_used_or_refused_in_a_sentence(door, first, second, n, m):
    refusal = None
    try:
        DOORS[door](first, second, n, m)
    except ValueError as error:
        refusal = str(error)
    assert refusal is None or re.fullmatch(r"[^\n]{20,}; [^\n]+", refusal), refusal

"""What a touch must bring to be counted, and what becomes of two that are one."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import fe
import models
from models.inverse import greedy

PLATE = fe.Plate((150.0, 100.0), 1.0, 3000.0, 0.38)
ANGLE = np.linspace(0, 2 * np.pi, 30, endpoint=False)
RING = np.column_stack([75 + 55 * np.cos(ANGLE), 50 + 35 * np.sin(ANGLE)])
FORWARD = models.gauge_forward(fe.influence(PLATE, RING), 1e-6)


def problem(measured, forward=FORWARD, max_touches=4):
    candidates = models.prepare_candidates(forward)
    solver = models.LevenbergMarquardt()
    prior = models.Prior(np.zeros(3), np.zeros(3))
    return greedy.CountProblem(measured, candidates, prior, solver, max_touches, False)


def test_two_touches_that_are_one_are_merged_at_the_middle_of_their_forces():
    place = np.array([60.0, 40.0])
    rng = np.random.default_rng(1)
    measured = FORWARD.read(np.array([[*place, 3.0]]))[0] + rng.normal(size=3 * len(RING))
    task = problem(measured)
    touches = np.array([[60.4, 40.2, 1.0], [59.8, 39.9, 2.0]])
    fit = task.fit(touches)
    apart = fit._replace(touches=touches)
    merged = list(greedy._with_one_less(apart, gain=1e9))[1]
    force = touches[:, 2]
    np.testing.assert_allclose(merged, [[*(force @ touches[:, :2] / force.sum()), force.sum()]])
    assert len(greedy.pruned(task, fit).touches) == 1


@dataclass(frozen=True, eq=False)
class Rough:
    """A forward model that is right to a fraction of what is measured."""

    forward: models.LinearForward
    model_error: float

    def __getattr__(self, name):
        return getattr(self.forward, name)


@pytest.mark.parametrize("error", [0.01, 0.05])
def test_a_rough_model_must_be_contradicted_by_more_than_its_own_error(error):
    measured = FORWARD.read(np.array([[60.0, 40.0, 2.0]]))[0]
    sure, rough = problem(measured), problem(measured, Rough(FORWARD, error))
    assert sure.gain == greedy.GAIN
    assert rough.gain == pytest.approx(greedy.GAIN + error**2 * (measured @ measured))


def test_effort_is_counted_over_all_descents_of_a_problem():
    measured = FORWARD.read(np.array([[60.0, 40.0, 2.0], [110.0, 70.0, 1.0]]))[0]
    task = problem(measured)
    first = task.fit(np.array([[70.0, 45.0, 1.0]]))
    second = replace(task, max_touches=1).fit(first.touches)
    stats = task.stats(second)
    assert stats.descents == 2
    assert stats.steps == first.steps + second.steps
    assert stats.evaluations == first.evaluations + second.evaluations


def test_a_score_rules_out_no_touches_that_a_descent_would_keep():
    """Beside two touches that come closer and weaker, one alone is ruled out or fitted worse."""
    rng, ruled_out = np.random.default_rng(4), 0
    for apart in (40.0, 20.0, 10.0, 5.0, 2.0):
        for force in (3.0, 0.3, 0.03):
            touches = np.array([[60.0, 40.0, 2.0], [60.0 + apart, 50.0, force]])
            task = problem(FORWARD.read(touches)[0] + rng.normal(size=3 * len(RING)))
            fit = task.fit(touches)
            for fewer in greedy._with_one_less(fit, gain=1e9):
                if task.ruled_out(fewer, fit):
                    ruled_out += 1
                    assert task.fit(fewer).chi2 > fit.chi2 + task.gain
    assert ruled_out > 15
    assert not task.ruled_out(np.empty((0, 3)), fit)

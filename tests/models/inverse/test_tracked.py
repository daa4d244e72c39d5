"""A frame that follows another, in one compiled call, against the way of all others."""

import numpy as np
import pytest

import fe
import models
from models import CandidateGrid, Prior
from models.arrays import F64
from models.inverse.greedy import CountProblem, pruned
from models.inverse.levenberg_marquardt import LevenbergMarquardt
from models.inverse.prior import FLAT
from models.inverse.tracked import track

PLATE = fe.Plate((100.0, 80.0), 1.0, 3000.0, 0.3)
SOLVER = LevenbergMarquardt()
KNOWN = models.prior(place=(50.0, 40.0), place_sigma=200.0)


@pytest.fixture(scope="module")
def search() -> CandidateGrid:
    """Strain of a ring of gauges, with noise of a hundredth of what 1 N shows."""
    influence = fe.influence(PLATE, models.gauges_inside_edges(PLATE.size), mesh=fe.grid(PLATE, 20))
    unit = float(np.sqrt(np.mean(influence.strain([[50.0, 40.0], [30.0, 55.0]]) ** 2)))
    return models.prepare_candidates(models.gauge_forward(influence, 0.01 * unit)).prepare()


def pressed(search: CandidateGrid, touches: F64, seed: int) -> tuple[F64, F64]:
    """Measure touches (n, 3), and where they were in the frame before."""
    rng = np.random.default_rng(seed)
    exact = search.forward.read(touches)[0]
    return exact + rng.normal(size=exact.shape), touches + rng.normal(0, 0.2, touches.shape)


@pytest.mark.parametrize("prior", [FLAT, KNOWN], ids=["flat", "known place"])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_touches_that_stay_are_those_of_the_way_of_all_others(
    search: CandidateGrid, count: int, prior: Prior
) -> None:
    """Touches, covariance, χ² and steps are the same as those of descent, search and pruning."""
    touches = np.array([[70.0, 25.0, 4.0], [25.0, 30.0, 3.0], [45.0, 60.0, 5.0]])[:count]
    measured, start = pressed(search, touches, count)
    tracked = track(measured, search, start, prior, SOLVER)
    problem = CountProblem(measured, search, prior, SOLVER, 4, exact=False)
    fit = problem.fit(start)
    assert problem.explained(fit)
    assert pruned(problem, fit) is fit
    assert tracked is not None
    order = np.lexsort((fit.touches[:, 1], fit.touches[:, 0]))
    rows = (3 * order[:, None] + np.arange(3)).ravel()
    np.testing.assert_allclose(tracked.touches, fit.touches[order], rtol=1e-9)
    np.testing.assert_allclose(tracked.covariance, fit.covariance[rows][:, rows], rtol=1e-7)
    assert tracked.chi2 == pytest.approx(fit.chi2, rel=1e-9)
    assert tracked.freedom == problem.freedom(fit)
    assert (tracked.steps, tracked.evaluations) == (fit.steps, fit.evaluations)
    assert tracked.converged == fit.converged
    assert tracked.within == search.within(fit.touches)


@pytest.mark.parametrize(
    ("there", "followed"),
    [
        ([[70.0, 25.0, 4.0], [25.0, 30.0, 3.0]], [[70.0, 25.0, 4.0]]),
        ([[70.0, 25.0, 4.0]], [[70.0, 25.0, 4.0], [25.0, 30.0, 3.0]]),
        ([[70.0, 25.0, 4.0]], [[70.0, 25.0, 2.0], [70.3, 25.2, 2.0]]),
        ([[70.0, 25.0, 4.0]], np.empty((0, 3))),
    ],
    ids=["one came", "one went", "two that are one", "nothing before"],
)
def test_what_comes_or_goes_is_left_to_the_search(
    search: CandidateGrid, there: list[list[float]], followed: list[list[float]]
) -> None:
    """Then there is more to a frame than a descent, and the search still finds what is there."""
    measured, _ = pressed(search, np.array(there), 5)
    assert track(measured, search, np.array(followed), FLAT, SOLVER) is None
    assert models.find(measured, search, start=followed).count == len(there)

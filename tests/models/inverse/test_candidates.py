"""The search: candidates everywhere, the best of them by trying all."""

from itertools import combinations

import numpy as np
import pytest

import fe
import models
from models.inverse.candidates import EDGE

PLATE = fe.Plate((150.0, 100.0), 1.0, 3000.0, 0.38)
RNG = np.random.default_rng(11)
INFLUENCE = fe.influence(
    PLATE, RNG.uniform((5, 5), (145, 95), (9, 2)), fe.Mesh(PLATE.size, (24, 16))
)
FORWARD = models.gauge_forward(INFLUENCE, 1e-6)
SEARCH = models.prepare_candidates(FORWARD, count=9)
MEASURED = RNG.normal(0, 30, 27)
TANGENTS = {"alone": np.empty((0, 27)), "beside others": RNG.normal(0, 1, (3, 27))}


def fall(columns, tangent):
    """Fall of χ² by some columns whose factors come out positive, the tangent free; else 0."""
    tangent = tangent.T
    with_them = np.column_stack([columns.T, tangent])
    factors, *_ = np.linalg.lstsq(with_them, MEASURED, rcond=None)
    without = MEASURED - tangent @ np.linalg.lstsq(tangent, MEASURED, rcond=None)[0]
    left = MEASURED - with_them @ factors
    positive = (factors[: len(columns)] > 0).all()
    return without @ without - left @ left if positive else 0.0, factors[: len(columns)]


def test_candidates_lie_evenly_up_to_the_edge_zone():
    np.testing.assert_allclose(SEARCH.xy.min(axis=0), EDGE * np.array(PLATE.size))
    np.testing.assert_allclose(SEARCH.xy.max(axis=0), (1 - EDGE) * np.array(PLATE.size))
    assert len(np.unique(SEARCH.xy[:, 0])) == 9
    assert len(np.unique(SEARCH.xy[:, 1])) == 6
    np.testing.assert_array_equal(SEARCH.response, FORWARD.response(SEARCH.xy))


def test_bounds_hold_all_candidates_and_lie_on_the_plate():
    (low, high), forces = SEARCH.bounds[:, :2], SEARCH.bounds[:, 2]
    np.testing.assert_array_equal(forces, [0, np.inf])
    assert (SEARCH.xy > low).all()
    assert (SEARCH.xy < high).all()
    assert (low > 0).all()
    assert (high < PLATE.size).all()


@pytest.mark.parametrize("tangent", TANGENTS.values(), ids=TANGENTS)
def test_the_best_candidate_is_the_one_of_largest_fall(tangent):
    falls = [fall(column[None], tangent)[0] for column in SEARCH.response]
    index, gain, force = SEARCH.best(MEASURED, tangent)
    assert index == int(np.argmax(falls))
    assert gain == pytest.approx(max(falls))
    assert force == pytest.approx(fall(SEARCH.response[[index]], tangent)[1][0])


@pytest.mark.parametrize("tangent", TANGENTS.values(), ids=TANGENTS)
def test_the_best_pair_is_the_one_of_largest_fall(tangent):
    pairs = list(combinations(range(len(SEARCH.xy)), 2))
    falls = [fall(SEARCH.response[list(pair)], tangent)[0] for pair in pairs]
    best = pairs[int(np.argmax(falls))]
    indices, force = SEARCH.best_pair(MEASURED, tangent)
    assert tuple(indices) == best
    np.testing.assert_allclose(force, fall(SEARCH.response[indices], tangent)[1])


def test_what_only_pulls_has_no_candidate():
    pull = -SEARCH.response.sum(axis=0)
    one = models.CandidateGrid(FORWARD, SEARCH.xy[:1], SEARCH.response[:1])
    residual = -SEARCH.response[0]
    assert one.best(residual, np.empty((0, 27)))[1] == 0.0
    assert np.isfinite(SEARCH.best(pull, np.empty((0, 27)))[1])
    two = models.CandidateGrid(FORWARD, SEARCH.xy[:2], SEARCH.response[:2])
    force = two.best_pair(-SEARCH.response[:2].sum(axis=0), np.empty((0, 27)))[1]
    np.testing.assert_array_equal(force, 0.0)


def test_a_candidate_that_is_free_already_gains_nothing():
    tangent = SEARCH.response[[20]]
    gains = [SEARCH.best(SEARCH.response[20], tangent)[1]]
    assert max(gains) < 1e-12 * (SEARCH.response[20] @ SEARCH.response[20])


def test_a_search_without_candidates_is_refused():
    with pytest.raises(
        ValueError,
        match=r"^candidates along a side must .* 2 or more, got 1; use",
    ):
        models.prepare_candidates(FORWARD, count=1)

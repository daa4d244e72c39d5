"""Plans of data sets: which touches they hold."""

from itertools import combinations
from math import comb

import numpy as np
import pytest
from hypothesis import given, strategies as st

from models.data import sampling_plan as plan_module
from models.data.dataset import grid_places
from models.data.sampling_plan import SamplingPlan, TouchBox, TouchLattice

PLACES = grid_places((60.0, 40.0), spacing=10.0, margin=10.0)  # 5 x 3
FORCES = np.array([0.5, 1.0, 1.5])  # N


def lattice(touches, samples=None, forces=FORCES, **options):
    return SamplingPlan(TouchLattice(PLACES, forces), touches, samples, **options)


def everything(plan):
    return np.concatenate([plan.block(number) for number in range(plan.blocks)])


@pytest.mark.parametrize("touches", [1, 2, 3])
def test_without_a_number_of_samples_a_lattice_gives_every_combination_once(touches):
    plan = lattice(touches, forces=FORCES[:2])
    got = everything(plan)
    assert len(got) == plan.rows == comb(15, touches) * 2**touches
    assert len(np.unique(got.reshape(len(got), -1), axis=0)) == len(got)
    places = {tuple(map(tuple, sample[:, :2])) for sample in got}
    by_x = sorted(map(tuple, PLACES))
    assert places == set(combinations(by_x, touches))
    assert set(got[..., 2].ravel()) == {0.5, 1.0}


def test_one_touch_on_the_grid_of_the_paper_is_its_289_places():
    places = grid_places((100.0, 100.0), spacing=5.0, margin=10.0)
    got = everything(SamplingPlan(TouchLattice(places, np.ones(1)), 1, None))
    assert got.shape == (289, 1, 3)
    np.testing.assert_array_equal(got[:, 0, :2], places)
    np.testing.assert_array_equal(got[:, 0, 2], 1.0)


@given(touches=st.integers(1, 3), samples=st.integers(1, 45), seed=st.integers(0, 2**32))
def test_drawn_samples_do_not_repeat_and_are_sorted(touches, samples, seed):
    got = everything(lattice(touches, samples, seed=seed))
    assert got.shape == (samples, touches, 3)
    assert len(np.unique(got.reshape(samples, -1), axis=0)) == samples
    for sample in got[:, :, :2].tolist():
        assert sample == sorted(sample)
        assert len({tuple(place) for place in sample}) == touches


def test_drawn_combinations_are_even_in_place_and_force():
    got = everything(lattice(2, 600, seed=3))
    forces = (got[..., 2, None] == FORCES).mean(axis=(0, 1))
    np.testing.assert_allclose(forces, 1 / 3, atol=0.03)
    per_place = (got[:, :, None, :2] == PLACES).all(axis=-1).sum(axis=(0, 1))
    assert per_place.min() > 0.75 * 1200 / 15


def test_a_box_is_filled_evenly():
    plan = SamplingPlan(TouchBox((10.0, 5.0, 1.0), (50.0, 35.0, 10.0)), 2, 20000, seed=5)
    got = everything(plan)
    assert got.shape == (20000, 2, 3)
    assert np.all((got >= (10, 5, 1)) & (got <= (50, 35, 10)))
    np.testing.assert_allclose(got.mean(axis=(0, 1)), [30.0, 20.0, 5.5], rtol=0.01)
    assert np.all(got[:, 0, 0] <= got[:, 1, 0])


@pytest.mark.parametrize("source", [TouchLattice(PLACES, FORCES), TouchBox((0, 0, 1), (60, 40, 1))])
def test_the_seed_decides(source, monkeypatch):
    monkeypatch.setattr(plan_module, "BLOCK", 64)
    first, again, other = (everything(SamplingPlan(source, 2, 200, seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    assert len(np.unique(first.reshape(200, -1), axis=0)) == 200  # blocks differ


def test_a_block_needs_none_before_it(monkeypatch):
    monkeypatch.setattr(plan_module, "BLOCK", 64)
    plan = lattice(2, 200, seed=4)
    whole = everything(plan)
    assert plan.blocks == 4
    np.testing.assert_array_equal(lattice(2, 200, seed=4).block(3), whole[192:])


def test_doubled_samples_come_twice_with_their_touches_swapped():
    once, twice = lattice(2, 30), lattice(2, 30, order="doubled")
    assert (twice.rows, twice.count) == (60, 30)
    got = everything(twice)
    np.testing.assert_array_equal(got[::2], everything(once))
    np.testing.assert_array_equal(got[1::2], everything(once)[:, ::-1])


def test_the_set_of_the_paper_with_ten_magnitudes_is_drawn_from_four_million():
    places = grid_places((100.0, 100.0), spacing=5.0, margin=10.0)
    plan = SamplingPlan(TouchLattice(places, np.arange(1.0, 11.0)), 2, 86400)
    assert plan.combinations == 41616 * 100
    assert plan.rows == 86400
    got = everything(plan)
    assert len(np.unique(got.reshape(len(got), -1), axis=0)) == 86400


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: lattice(4), "touches of a sample must be 1 to 3, got 4"),
        (lambda: lattice(1, 0), "number of samples must be at least 1, got 0"),
        (lambda: lattice(1, 46), "45 combinations of 1 touches, got 46 samples; ask for no more"),
        (lambda: lattice(1, order="doubled"), "swaps touches and needs 2 or 3, got 1"),
        (
            lambda: SamplingPlan(TouchBox((0, 0, 1), (1, 1, 1)), 1, None),
            "need a number of samples, got none",
        ),
        (lambda: SamplingPlan(TouchLattice(PLACES[:2], FORCES), 3, None), "must have 1 to"),
    ],
)
def test_bad_plans_are_refused(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()

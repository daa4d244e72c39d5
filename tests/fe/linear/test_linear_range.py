"""The linear range: how far linear theory is off, compared with von Kármán's plate solved in full.

The estimate itself solves nothing nonlinear; `rig.studies.plates.regime` compares it with a shell.
"""

import dataclasses

import numpy as np
import pytest

import fe
from fe.elements.functional import derivative
from fe.linear.linear_range import linear_range
from fe.linear.validity import LINEAR_TOLERANCE, LinearRange
from fe.reduced.karman import Karman

C, S, F = fe.Clamped(), fe.Supported(), fe.Free()
PVC = fe.Plate((254.0, 180.0), thickness=1.0, young=3000.0, poisson=0.38)
EDGES = {
    "clamped": C,
    "supported": S,
    "two clamped": fe.Edges(C, C, F, F),
    "one clamped": fe.Edges(C, F, F, F),
    "mixed": fe.Edges(C, S, F, S),
    "soft": fe.Elastic(deflection=5.0, rotation=500.0, membrane=20.0),
}


def held(edges):
    return dataclasses.replace(PVC, edges=edges)


def force_for(plate, ratio):
    """Force that deflects to about `ratio` thicknesses, N."""
    return ratio * 1e-6 / linear_range(plate, 1e-6).ratio


@pytest.mark.parametrize("edges", EDGES.values(), ids=EDGES.keys())
@pytest.mark.parametrize("ratio", [0.05, 0.3, 1.0])
def test_deflection_and_its_error_are_those_of_the_plate_that_stretches(edges, ratio):
    """Measured: within 1.6 % of the deflection, on hinges at w/h 0.7; 0.2 % at 0.3."""
    plate = held(edges)
    said = linear_range(plate, force_for(plate, ratio))
    mesh = fe.grid(plate, 16)
    touch, loads = derivative(mesh, np.array([said.place])), np.zeros((*mesh.shape, 1))
    touch.add_to(loads, np.array([-said.force]), np.array([0]))
    large = Karman(plate, mesh).solve(loads)
    assert large.residual < 1e-9
    true = -touch.of(large.values).item()
    linear = -touch.of(fe.Linear(plate, mesh).solve(loads)).item()
    assert said.deflection == pytest.approx(true, rel=0.02)
    assert said.ratio == pytest.approx(true / plate.thickness, rel=0.02)
    assert said.error > 0.9 * (linear / true - 1.0)


def test_the_place_has_the_largest_deflection_for_its_thickness():
    def place(plate):
        return linear_range(plate, 1.0).place

    assert place(PVC) == (127.0, 90.0)
    assert place(held(fe.Edges(C, F, F, F)))[0] == 254.0
    assert place(held(fe.Edges(F, F, C, C))) == (0.0, 90.0)
    thin = fe.Patch((40.0, 80.0), (20.0, 60.0), thickness=0.2, young=3000.0)
    x, y = place(dataclasses.replace(PVC, patches=(thin,)))
    assert 40.0 < x < 80.0
    assert 20.0 < y < 60.0


def test_the_error_of_strain_grows_as_the_deflection_and_that_of_deflection_as_its_square():
    errors = [linear_range(PVC, force_for(PVC, ratio)).error for ratio in (0.001, 0.01, 0.1)]
    assert errors[1] / errors[0] == pytest.approx(10.0, rel=0.01)
    assert errors[2] / errors[1] == pytest.approx(10.0, rel=0.1)


def test_a_plate_that_can_slide_at_its_edges_stays_linear_for_longer():
    free_to_slide = held(fe.Elastic(deflection=np.inf, rotation=0.0, membrane=0.0))
    ratio = 0.2
    held_in_plane, sliding = (
        linear_range(plate, force_for(plate, ratio)).error for plate in (held(S), free_to_slide)
    )
    assert sliding < 0.5 * held_in_plane


def test_one_percent_and_ten_percent_lie_where_they_are_known_to_lie():
    """Linear strain is off by 1 % at w/h of 0.02 to 0.05 and by 10 % at 0.2 to 0.35."""
    square = fe.Plate((100.0, 100.0), 1.0, 3000.0, 0.3)
    for edges in (C, S):
        plate = dataclasses.replace(square, edges=edges)
        error = {r: linear_range(plate, force_for(plate, r)).error for r in (0.02, 0.05, 0.2, 0.35)}
        assert error[0.02] < 0.0101
        assert error[0.05] > 0.01
        assert error[0.2] < 0.12
        assert error[0.35] > 0.09


def test_the_smaller_theory_is_taken_up_to_the_tolerance():
    weak, strong = linear_range(PVC, force_for(PVC, 0.1)), linear_range(PVC, force_for(PVC, 0.4))
    assert (weak.theory, strong.theory) == ("linear", "large")
    assert weak.error < LINEAR_TOLERANCE < strong.error
    assert strong.sentence.startswith("w/h is up to 0.38 under ")
    assert "at (127, 90) mm, where linear theory is off by 11 %" in strong.sentence
    assert linear_range(PVC, 1e3).sentence.endswith("off by more than 100 %")


def test_scale_changes_nothing():
    """Twice as large in all, with eight times the force over twice the modulus."""
    here = linear_range(PVC, 0.8)
    large = fe.Plate((508.0, 360.0), 2.0, 6000.0, 0.38)
    there = linear_range(large, 0.8 * 8)
    assert there.ratio == pytest.approx(here.ratio, rel=1e-6)
    assert there.error == pytest.approx(here.error, rel=1e-6)


@pytest.mark.parametrize("force", [0.0, -1.0, np.nan, np.inf])
def test_a_force_that_presses_nothing_is_refused(force):
    with pytest.raises(ValueError, match="expected force must be positive and finite, got"):
        linear_range(PVC, force)


def test_a_linear_range_comes_back_from_its_arrays():
    found = linear_range(held(EDGES["mixed"]), 2.0)
    assert LinearRange.from_arrays(found.arrays()) == found


@pytest.mark.slow
@pytest.mark.parametrize("edges", [C, fe.Edges(F, F, C, F)], ids=["clamped", "one long side"])
def test_a_long_plate_says_what_a_few_widths_of_it_say(edges):
    """A touch does not know of what is farther away; the error was 4.4 times too large at 50:1."""

    def said(length):
        return linear_range(fe.Plate((length, 80.0), 1.5, 3000.0, 0.3, edges), 2.0)

    few, many, far_more = said(320.0), said(2400.0), said(16000.0)
    for long in (many, far_more):
        assert long.ratio == pytest.approx(few.ratio, rel=0.005)
        assert long.error == pytest.approx(few.error, rel=0.02)
        assert long.demand == pytest.approx(few.demand, rel=0.05)


@pytest.mark.slow
def test_a_plate_says_the_same_turned_by_a_quarter():
    along, across = (
        linear_range(fe.Plate(size, 1.5, 3000.0, 0.3), 2.0)
        for size in ((900.0, 80.0), (80.0, 900.0))
    )
    assert along.error == pytest.approx(across.error, rel=1e-3)


def test_a_thick_plate_and_a_needle_are_refused():
    with pytest.raises(ValueError, match=r"plate thickness must stay below 0\.05 of the span"):
        linear_range(dataclasses.replace(PVC, thickness=30.0), 1.0)
    with pytest.raises(ValueError, match="at most 1000 times as long as wide, got 90000 x 80 mm"):
        linear_range(fe.Plate((90000.0, 80.0), 1.0, 3000.0, 0.3), 1.0)

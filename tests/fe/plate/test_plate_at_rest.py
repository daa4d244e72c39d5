"""Tension, shape and uneven edges as a plate describes them: checked, stored, and at points."""

import dataclasses
from math import inf, nan

import numpy as np
import pytest

import fe
from fe.elements.storage import restore, store
from fe.plate.edges import part_of, taper_of

SIZE = (120.0, 80.0)
PLATE = fe.Plate(SIZE, 1.2, 3000.0, 0.38)
BOWED = fe.Shape(sag=0.7, modes=((0.0, 0.1), (-0.2, 0.05), (0.3, 0.0)))
UNEVEN = fe.Elastic(inf, 400.0, membrane=30.0, taper=(0.0, -0.4, 0.7))


def changed(**changes):
    return dataclasses.replace(PLATE, **changes)


def test_a_sag_is_the_height_of_the_middle_and_leaves_edges_level():
    shape, at = fe.Shape(0.3), np.array([[60.0, 40.0], [0.0, 33.0], [71.0, 80.0]])
    assert shape.at(SIZE, at) == pytest.approx([0.3, 0.0, 0.0], abs=1e-15)
    assert changed(shape=shape).rise(at) == pytest.approx([0.3, 0.0, 0.0], abs=1e-15)
    assert PLATE.rise(at).tolist() == [0.0, 0.0, 0.0]
    for p, q in ((1, 0), (0, 1)):
        assert shape.at(SIZE, at, p, q) == pytest.approx(0.0, abs=1e-15)


def test_a_shape_is_the_sum_that_it_says():
    x, y = np.array([3.0, 50.0, 111.0]), np.array([70.0, 20.0, 5.0])
    xi, eta = 2 * x / 120 - 1, 2 * y / 80 - 1
    bow = np.sin(np.pi * x / 120) ** 2 * np.sin(np.pi * y / 80) ** 2
    low = 0.1 * eta - 0.2 * xi + 0.05 * xi * eta + 0.3 * (1.5 * xi**2 - 0.5)
    assert BOWED.at(SIZE, np.column_stack([x, y])) == pytest.approx(0.7 * bow + low, rel=1e-12)


@pytest.mark.parametrize(("p", "q"), [(1, 0), (0, 1), (2, 0), (0, 2), (1, 1)])
def test_derivatives_of_a_shape_are_those_of_its_height(p, q):
    at, e = np.array([[33.0, 61.0], [90.0, 17.0]]), 0.1
    lower = (p - 1, q) if p else (p, q - 1)
    step = e * np.array([1.0, 0.0] if p else [0.0, 1.0])
    ahead, behind = (BOWED.at(SIZE, at + s * step, *lower) for s in (1, -1))
    assert BOWED.at(SIZE, at, p, q) == pytest.approx((ahead - behind) / (2 * e), rel=1e-4)
    on_grid = BOWED.on_grid(SIZE, at[:, 0], at[:, 1], p, q)
    assert np.diag(on_grid) == pytest.approx(BOWED.at(SIZE, at, p, q))


def test_a_part_of_an_uneven_edge_has_the_compliance_of_the_whole_there():
    low, high = -0.3, 0.8
    part, s = part_of(UNEVEN, low, high), np.linspace(-1.0, 1.0, 5)
    inner = 0.5 * (low + high) + 0.5 * (high - low) * s
    for k, of_part, taper, part_taper in zip(
        UNEVEN.springs, part.springs, taper_of(UNEVEN), taper_of(part), strict=True
    ):
        assert (1 + part_taper * s) / of_part == pytest.approx((1 + taper * inner) / k)


def test_one_taper_stands_for_all_springs_that_give():
    edge = fe.Elastic(inf, 400.0, taper=0.2)
    assert edge.taper == (0.2, 0.2, 0.2)
    assert taper_of(edge) == (0.0, 0.2, 0.0)
    assert taper_of(fe.Clamped()) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("make", "numbers", "sentence"),
    [
        (fe.Elastic, {"taper": 1.0}, "taper of the deflection spring must lie between -1 and 1"),
        (fe.Elastic, {"taper": (0, -1.2, 0)}, "taper of the rotation spring must lie"),
        (fe.Elastic, {"taper": nan}, "taper of the deflection spring must lie"),
        (fe.Elastic, {"taper": (0.1, 0.2)}, "taper of an edge must be one number or three"),
        (fe.Shape, {"sag": nan}, "shape of a plate must be finite, got sag nan mm"),
        (fe.Shape, {"modes": ((0.0,), (1.0, 2.0))}, "modes of a shape must form an array in mm"),
        (fe.Shape, {"modes": (0.0, 1.0)}, "modes of a shape must be rows of coefficients in mm"),
        (changed, {"tension": (1.0, 2.0)}, "plate tension must be three finite numbers Nxx"),
        (changed, {"tension": (1.0, nan, 0.0)}, "plate tension must be three finite numbers"),
        (changed, {"shape": 0.3}, r"plate shape must be Shape\(...\) or None, got 0.3"),
        (changed, {"shape": fe.Shape(5.0)}, "shape of a plate must be shallow, slopes up to 0.1"),
    ],
)
def test_what_no_plate_can_be_is_refused(make, numbers, sentence):
    springs = {"deflection": 1.0, "rotation": 2.0} if make is fe.Elastic else {}
    with pytest.raises(ValueError, match="^" + sentence):
        make(**springs, **numbers)


@pytest.mark.parametrize("shape", [None, fe.Shape(0.2), BOWED])
def test_stored_plates_come_back(shape):
    edges = fe.Edges(UNEVEN, fe.Clamped(), fe.Supported(), fe.Elastic(2.0, 0.0, taper=0.5))
    plate = changed(edges=edges, tension=(0.5, -0.1, 0.02), shape=shape)
    again, mesh, (extra,) = restore(store(plate, fe.grid(plate, 12), extra=[1.0, 2.0]), "extra")
    assert again.tension == plate.tension
    assert again.shape == plate.shape
    assert mesh == fe.grid(plate, 12)
    assert extra.tolist() == [1.0, 2.0]
    for side in ("west", "east", "south", "north"):
        one, other = getattr(again.sides, side), getattr(plate.sides, side)
        assert (one.springs, taper_of(one)) == (other.springs, taper_of(other))


def test_plates_stored_before_there_was_more_to_say_are_read():
    arrays = store(PLATE, fe.grid(PLATE, 12))
    for name in ("tapers", "tension"):
        del arrays[name]
    assert restore(arrays)[0] == PLATE


def test_a_plate_without_its_shape_is_flat():
    assert changed(shape=BOWED, tension=(1.0, 0.0, 0.0)).flat == changed(tension=(1.0, 0.0, 0.0))
    assert PLATE.flat is PLATE

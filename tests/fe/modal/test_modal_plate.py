"""A plate in modes on its bench: against the whole plate, and its derivatives."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

import fe
from fe.elements.functional import derivative
from fe.modal.transverse import rigidly_held
from fe.reduced.karman import Karman
from fe.reduced.training import pressure
from tests.fe.modal.differences import by_parameter, by_touches, loosened

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
NAMES = [name for name, _ in fe.BENCH_PARAMETERS]
TOUCHES = np.array([[50.0, 40.0, 6.0], [110.0, 75.0, 3.0]])
UNEVEN = fe.bench_values(
    young=-0.1,
    thickness_x=0.05,
    tension_xx=0.3,
    tension_xy=0.1,
    sag=0.2,
    sag_x=0.1,
    rotation_west=2e-4,
    rotation_west_slope=1e-4,
    membrane_west=0.016,
    membrane_south=0.02,
    membrane_south_slope=0.005,
)


@pytest.fixture(scope="module")
def modal():
    return fe.modal_plate(PLATE, 50, fe.grid(PLATE, 20))


def deflection(modal, values, touches, xy):
    state = fe.BenchPlate(modal, values).press(np.asarray(touches, dtype=float))
    assert state.converged
    return modal.value(xy) @ state.amplitudes


def places(count=200):
    rng = np.random.default_rng(2)
    return rng.uniform([8, 8], [142, 102], (count, 2))


def whole(plate, touches, xy):
    """Deflection of the whole plate of von Kármán on its own mesh."""
    karman = Karman(plate, fe.grid(plate, 24))
    state = karman.solve(pressure(karman, tuple(fe.Touch(*touch) for touch in touches)))
    return derivative(karman.mesh, xy).of(state.values)[:, 0]


def off(found, true):
    return np.linalg.norm(found - true) / np.linalg.norm(true)


def test_a_light_touch_bends_it_as_the_linear_plate(modal):
    xy = places()
    linear = fe.deflect(PLATE, [fe.Touch(55.0, 70.0, 1e-3)]).deflection(xy)
    assert off(deflection(modal, fe.bench_values(), [(55, 70, 1e-3)], xy), linear) < 0.01


@pytest.fixture(scope="module", params=[fe.Supported(), fe.Edges(*[fe.Supported()] * 3, fe.Free())])
def without_clamps(request):
    """Plate without a clamped edge, as it is and in modes."""
    plate = replace(PLATE, edges=request.param)
    return plate, fe.modal_plate(plate, 50, fe.grid(plate, 20))


@pytest.mark.parametrize("force", [1e-3, 4.0])
def test_a_plate_without_a_clamped_edge_bends_as_the_whole_one(without_clamps, force):
    (plate, found), xy = without_clamps, places()
    touches = [(55.0, 70.0, force)]
    assert off(deflection(found, fe.bench_values(), touches, xy), whole(plate, touches, xy)) < 0.01


@pytest.mark.parametrize(
    ("values", "plate"),
    [
        ({}, PLATE),
        (
            {"young": np.log(0.9), "thickness": np.log(1.04)},
            replace(PLATE, young=2700.0, thickness=1.04),
        ),
        (
            {f"membrane_{side}": 0.01 for side in ("west", "east", "south", "north")},
            replace(PLATE, edges=fe.Elastic(inf, inf, 100.0)),
        ),
        (
            {"rotation_south": 5e-3},
            replace(
                PLATE,
                edges=fe.Edges(
                    fe.Clamped(), fe.Clamped(), fe.Elastic(inf, 200.0, inf), fe.Clamped()
                ),
            ),
        ),
        ({"tension_xx": 0.5, "tension_yy": -0.2}, replace(PLATE, tension=(0.5, -0.2, 0.0))),
        ({"sag": 0.3}, replace(PLATE, shape=fe.Shape(sag=0.3))),
    ],
    ids=["as described", "softer and thicker", "slipping", "turning", "tense", "bowed"],
)
def test_it_bends_as_the_whole_plate_does(modal, values, plate):
    xy, touches = places(), [(55.0, 70.0, 8.0)]
    true = whole(plate, touches, xy)
    assert np.abs(true).max() > 0.5  # half the thickness: far from linear
    assert off(deflection(modal, fe.bench_values(**values), touches, xy), true) < 0.015


@pytest.mark.slow
def test_a_corner_beside_a_free_edge_is_held_by_the_other_alone():
    free = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())
    soft = fe.Edges(fe.Elastic(inf, inf, 60.0), fe.Elastic(inf, inf, 80.0), fe.Free(), fe.Free())
    rigid = replace(PLATE, edges=free)
    modal = fe.modal_plate(rigid, 50, fe.grid(rigid, 20))
    xy, touches = places(), [(45.0, 25.0, 4.0)]
    sizes = []
    for numbers, plate in (
        ({}, rigid),
        ({"membrane_west": 1 / 60.0, "membrane_east": 1 / 80.0}, replace(rigid, edges=soft)),
    ):
        true = whole(plate, touches, xy)
        found = deflection(modal, fe.bench_values(**numbers), touches, xy)
        sizes.append((found @ true) / (true @ true))
    assert sizes[1] == pytest.approx(sizes[0], abs=8e-4)
    alone = fe.bench_values(membrane_south=0.02, membrane_north=0.02, membrane_south_slope=0.01)
    np.testing.assert_array_equal(
        deflection(modal, alone, touches, xy), deflection(modal, fe.bench_values(), touches, xy)
    )


def test_what_a_description_gives_are_the_same_numbers(modal):
    soft = replace(
        PLATE,
        edges=fe.Elastic(inf, 400.0, 100.0, taper=0.2),
        tension=(0.4, -0.1, 0.05),
        shape=fe.Shape(sag=-0.2),
    )
    assert rigidly_held(soft) == rigidly_held(PLATE)  # so that all products are the same
    sides = ("west", "east", "south", "north")
    numbers = {f"rotation_{side}": 1 / 400.0 for side in sides}
    numbers |= {f"membrane_{side}": 0.01 for side in sides}
    numbers |= {f"{name}_slope": 0.2 * value for name, value in numbers.items()}
    numbers |= {"tension_xx": 0.4, "tension_yy": -0.1, "tension_xy": 0.05, "sag": -0.2}
    xy, touches = places(), [(60.0, 40.0, 7.0)]
    found = deflection(replace(modal, plate=soft), fe.bench_values(), touches, xy)
    assert off(found, deflection(modal, fe.bench_values(**numbers), touches, xy)) < 1e-9


def test_derivatives_by_touches(modal):
    bench = fe.BenchPlate(modal, UNEVEN)
    exact = bench.press(TOUCHES).jacobian()
    for found, numeric in zip(exact.T, by_touches(bench, TOUCHES), strict=True):
        assert np.abs(numeric - found).max() < 1e-5 * np.abs(numeric).max()


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_by_the_bench(modal, name):
    values = loosened(UNEVEN)
    exact = fe.BenchPlate(modal, values).press(TOUCHES).by_parameters()[:, NAMES.index(name)]
    numeric = by_parameter(modal, values, TOUCHES, name)
    assert np.abs(numeric).max() > 0
    assert np.abs(numeric - exact).max() < 1e-5 * np.abs(numeric).max()


@pytest.mark.parametrize("name", ["membrane_east", "rotation_south"])
def test_edges_give_and_never_push(modal, name):
    """The end that would push is rigid: 0.01 and -0.07 at both ends are 0.01 and 0."""
    size = 1e-3 if name.startswith("rotation") else 0.03
    below = fe.bench_values(**{name: -size, f"{name}_slope": 4.0 / 3.0 * size})
    limited = fe.bench_values(**{name: size / 6.0, f"{name}_slope": size / 6.0})
    pushing, found, rigid = (
        fe.BenchPlate(modal, values).press(TOUCHES).values
        for values in (below, limited, fe.bench_values())
    )
    assert np.allclose(pushing, found, rtol=1e-9)
    assert not np.allclose(pushing, rigid, rtol=1e-4)


@pytest.mark.parametrize("change", [{}, {"young": 0.02, "sag": -0.05, "membrane_west": 0.004}])
def test_a_state_near_by_leads_to_the_same_one(modal, change):
    """Also one of a bench near by."""
    bench, moved = fe.BenchPlate(modal, UNEVEN), TOUCHES + np.array([0.4, -0.3, 0.2])
    near = fe.BenchPlate(modal, UNEVEN + fe.bench_values(**change)).press(TOUCHES)
    assert np.allclose(bench.press(moved, near).values, bench.press(moved).values, rtol=1e-6)


def test_files_hold_all_of_it(modal):
    again = fe.ModalPlate.from_arrays(modal.arrays())
    states = [fe.BenchPlate(one, UNEVEN).press(TOUCHES).values for one in (modal, again)]
    assert np.array_equal(*states)


def test_a_number_that_no_bench_has_is_refused():
    with pytest.raises(ValueError, match=r"no bench has a 'sagging'; use one of young, "):
        fe.bench_values(sagging=1.0)

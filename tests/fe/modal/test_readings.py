"""Strain at gauges of a plate in modes: against the whole plate, and its derivatives."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

import fe
from fe.reduced.karman import Karman
from fe.reduced.training import pressure
from tests.fe.modal.differences import by_parameter, by_touches, loosened

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
NAMES = [name for name, _ in fe.BENCH_PARAMETERS]
TOUCHES = np.array([[50.0, 40.0, 6.0], [110.0, 75.0, 3.0]])
# On two edges and inside; none lies nearer to a corner than an eighth of a side.
GAUGES = np.array([[0.0, 30.0], [0.0, 85.0], [75.0, 0.0], [130.0, 0.0], [60.0, 90.0]])
GIVING = fe.bench_values(
    tension_xx=0.1,
    sag=0.2,
    rotation_west=5e-4,
    membrane_west=0.016,
    membrane_south=0.02,
    membrane_north=0.004,
)


@pytest.fixture(scope="module")
def modal():
    mesh = fe.grid(PLATE, 20)
    return fe.modal_plate(PLATE, 60, mesh, readings=fe.strain_readings(mesh, GAUGES, 0.5))


def read(modal, values):
    """Strain at the gauges, (3 M,), of the plate in modes."""
    state = fe.BenchPlate(modal, values).press(TOUCHES)
    bent = np.tensordot(
        fe.strain_readings(modal.mesh, GAUGES, 0.5).bent, modal.values, ([0, 1], [0, 1])
    )
    functions, details, stretched = np.split(
        state.values, np.cumsum([len(state.amplitudes), 3 * len(GAUGES)])
    )
    return bent @ functions + details + stretched


def whole(plate):
    """Read the whole plate of von Kármán on its own mesh."""
    karman = Karman(plate, fe.grid(plate, 30))
    state = karman.solve(pressure(karman, tuple(fe.Touch(*touch) for touch in TOUCHES)))
    readings = fe.strain_readings(karman.mesh, GAUGES, 0.5)
    return readings.of(state.values[..., 0], state.plane.values[..., 0])


@pytest.mark.parametrize(
    ("values", "plate"),
    [
        (fe.bench_values(), PLATE),
        (fe.bench_values(tension_xx=0.1), replace(PLATE, tension=(0.1, 0.0, 0.0))),
        (fe.bench_values(sag=0.2), replace(PLATE, shape=fe.Shape(sag=0.2))),
        (
            GIVING,
            replace(
                PLATE,
                tension=(0.1, 0.0, 0.0),
                shape=fe.Shape(sag=0.2),
                edges=fe.Edges(
                    fe.Elastic(inf, 2000.0, 1 / 0.016),
                    fe.Clamped(),
                    fe.Elastic(inf, inf, 50.0),
                    fe.Elastic(inf, inf, 250.0),
                ),
            ),
        ),
    ],
)
def test_gauges_read_what_those_on_the_whole_plate_do(modal, values, plate):
    true = whole(plate)
    assert np.abs(read(modal, values) - true).max() < 0.015 * np.abs(true).max()


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_of_readings_by_the_bench(modal, name):
    values = loosened(GIVING)
    exact = fe.BenchPlate(modal, values).press(TOUCHES).by_parameters()[:, NAMES.index(name)]
    numeric = by_parameter(modal, values, TOUCHES, name)
    for some in np.split(np.arange(len(exact)), np.cumsum([len(modal.stiffness), len(GAUGES) * 3])):
        assert np.abs(numeric - exact)[some].max() <= 2e-5 * np.abs(numeric[some]).max() + 1e-12


def test_derivatives_of_readings_by_touches(modal):
    bench = fe.BenchPlate(modal, GIVING)
    exact = bench.press(TOUCHES).jacobian()
    details = slice(len(modal.stiffness), len(modal.stiffness) + 3 * len(GAUGES))
    for found, numeric in zip(exact.T, by_touches(bench, TOUCHES), strict=True):
        off = np.abs(numeric - found)
        assert off.max() < 1e-5 * np.abs(numeric).max()
        assert off[details].max() < 1e-4 * np.abs(numeric[details]).max()


def test_files_hold_what_gauges_read(modal):
    again = fe.ModalPlate.from_arrays(modal.arrays())
    states = [fe.BenchPlate(one, GIVING).press(TOUCHES).values for one in (modal, again)]
    assert np.array_equal(*states)

"""What a bench adds to a plate in modes, against the plate described so and solved whole."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from numpy.polynomial.legendre import Legendre, legfit

import fe
from fe.elements.functional import derivative
from fe.reduced.karman import Karman
from fe.reduced.training import pressure

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)
DEGREE = 16
TOUCHES = ((50.0, 40.0, 5.0), (110.0, 75.0, 3.0))


def held(order):
    """Coefficients of cos²(πs/2) P_order(s) in Legendre's polynomials, to rounding."""
    s = np.cos(np.linspace(0.0, np.pi, 201))
    return legfit(s, np.cos(0.5 * np.pi * s) ** 2 * Legendre.basis(order)(s), DEGREE)


def shape(*terms):
    """Shape of heights of products of `held` functions: (mm, order along x, along y)."""
    table = sum(height * np.multiply.outer(held(i), held(j)) for height, i, j in terms)
    return fe.Shape(modes=tuple(map(tuple, table.tolist())))


def giving(rotation, membrane):
    """Edge of compliances (even, rising along it) in 1/N and mm²/N."""
    tapers = (0.0, rotation[1] / rotation[0], membrane[1] / membrane[0])
    return fe.Elastic(inf, 1 / rotation[0], 1 / membrane[0], taper=tapers)


CASES = {
    "pulled": (
        {"tension_xx": 0.4, "tension_yy": 0.2, "tension_xy": 0.15},
        {"tension": (0.4, 0.2, 0.15)},
    ),
    "pressed": ({"tension_xx": -0.2, "tension_yy": -0.1}, {"tension": (-0.2, -0.1, 0.0)}),
    "bowed": (
        {"sag": 0.3, "sag_x": 0.2, "sag_xy": -0.1},
        {"shape": shape((0.3, 0, 0), (0.2, 1, 0), (-0.1, 1, 1))},
    ),
    "sunk": ({"sag": -0.3, "sag_yy": 0.1}, {"shape": shape((-0.3, 0, 0), (0.1, 0, 2))}),
    "uneven": (
        {
            "rotation_west": 0.02,
            "rotation_west_slope": -0.016,
            "membrane_west": 0.08,
            "membrane_west_slope": -0.06,
            "rotation_south": 0.01,
            "rotation_south_slope": -0.009,
            "membrane_south": 0.05,
            "membrane_south_slope": 0.03,
        },
        {
            "edges": fe.Edges(
                giving((0.02, -0.016), (0.08, -0.06)),
                fe.Clamped(),
                giving((0.01, -0.009), (0.05, 0.03)),
                fe.Clamped(),
            )
        },
    ),
}


@pytest.fixture(scope="module")
def modal():
    return fe.modal_plate(PLATE, 50, fe.grid(PLATE, 20))


@pytest.mark.parametrize(("numbers", "described"), CASES.values(), ids=list(CASES))
def test_a_bench_bends_as_the_plate_described_so(modal, numbers, described):
    plate = replace(PLATE, **described)
    rng = np.random.default_rng(2)
    xy = rng.uniform([8, 8], [142, 102], (200, 2))
    state = fe.BenchPlate(modal, fe.bench_values(**numbers)).press(np.array(TOUCHES))
    assert state.converged
    found = modal.value(xy) @ state.amplitudes
    bent = []
    for each in (plate, PLATE):
        karman = Karman(each, fe.grid(each, 24))
        loads = pressure(karman, tuple(fe.Touch(*touch) for touch in TOUCHES))
        bent.append(derivative(karman.mesh, xy).of(karman.solve(loads).values)[:, 0])
    true, plain = bent
    assert np.linalg.norm(true - plain) > 0.04 * np.linalg.norm(true)
    # measured 0.5 to 0.7 % on even edges
    assert np.linalg.norm(found - true) < 0.015 * np.linalg.norm(true)

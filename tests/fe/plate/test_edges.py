"""Edges of every kind against Lévy's series, strips that bend as beams, and limits of springs."""

from math import inf, isinf

import numpy as np
import pytest

import fe
from rig.studies.plates.levy import levy

C, S, F = fe.Clamped(), fe.Supported(), fe.Free()
SIZE = (100.0, 80.0)
PAIRS = {
    "supported": (S, S),
    "clamped": (C, C),
    "clamped and free": (C, F),
    "supported and free": (S, F),
    "free": (F, F),
    "elastic": (fe.Elastic(3.0, 400.0), fe.Elastic(inf, 900.0)),
    "clamped and elastic": (C, fe.Elastic(0.7, 0.0)),
}


def plate(south, north, size=SIZE, poisson=0.3):
    return fe.Plate(size, 1.2, 3000.0, poisson, fe.Edges(S, S, south, north))


def test_the_series_gives_the_known_supported_square():
    square = plate(S, S, (100.0, 100.0))
    w, _ = levy(square, (50.0, 50.0), (50.0, 50.0), terms=20000)
    assert w * square.rigidity / 1e4 == pytest.approx(0.011600839772, rel=1e-9)


def test_the_series_gives_the_known_clamped_half_plane():
    # Other edges a thousand times as far away: w = P d² / 4πD under the load.
    wide = plate(C, F, (2000.0, 1000.0))
    w, _ = levy(wide, (1000.0, 1.0), (1000.0, 1.0), terms=400000)
    assert w * wide.rigidity == pytest.approx(1 / (4 * np.pi), rel=1e-5)


LOADS = ((50.0, 40.0), (23.0, 61.0))
PLACES = np.array([(50.0, 0.0), (40.0, 10.0), (10.0, 80.0), (96.0, 75.0), (0.0, 20.0)])


@pytest.mark.parametrize("edges", PAIRS.values(), ids=PAIRS)
def test_every_kind_of_edge_meets_the_series(edges):
    one = plate(*edges)
    solver = fe.Linear(one, fe.Mesh(SIZE, (100, 80)))
    for load in LOADS:
        state = solver.deflect([fe.Touch(*load, 2.5)])
        w, _ = levy(one, load, load, terms=20000)
        assert fe.compliance(solver, [load])[0] == pytest.approx(w, rel=5e-6)
        assert state.deflection([load])[0] == pytest.approx(-2.5 * w, rel=1.2e-4)
        truth = [levy(one, load, at) for at in PLACES]
        deflection = -2.5 * np.array([w for w, _ in truth])
        strain = 0.6 * 2.5 * np.array([curvature for _, curvature in truth])
        np.testing.assert_allclose(state.deflection(PLACES), deflection, atol=1e-5 * 2.5 * w)
        np.testing.assert_allclose(state.strain(PLACES), strain, atol=1e-5 * np.abs(strain).max())


@pytest.mark.parametrize("kind", [C, S, F])
def test_an_elastic_edge_with_springs_of_nothing_or_of_rock_is_the_plain_one(kind):
    springs = [1e12 if isinf(k) else 0.0 for k in kind.springs]
    plain, elastic = (plate(C, edge) for edge in (kind, fe.Elastic(*springs)))
    mesh = fe.Mesh(SIZE, (20, 16))
    one, other = (fe.deflect(p, [fe.Touch(41.0, 60.0, 1.0)], mesh) for p in (plain, elastic))
    np.testing.assert_allclose(one.strain(PLACES), other.strain(PLACES), rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("edges", [F, fe.Edges(S, F, F, F), fe.Elastic(0.0, 5.0)])
def test_a_plate_that_nothing_holds_is_refused(edges):
    with pytest.raises(ValueError, match=r"^plate edges must hold the plate, got west "):
        fe.Plate(SIZE, 1.0, 3000.0, 0.3, edges)


def test_an_edge_that_barely_holds_is_refused_before_rounding_shows():
    barely = fe.Plate(SIZE, 1.2, 3000.0, 0.3, fe.Elastic(1e-13, 0.0))
    with pytest.raises(ValueError, match=r"^stiffness of the plate has condition number .*e\+"):
        fe.deflect(barely, [fe.Touch(50.0, 40.0, 1.0)])


@pytest.mark.parametrize(
    "edges",
    [fe.Edges(C, F, F, F), fe.Edges(S, F, F, S), fe.Edges(S, fe.Elastic(0.0, 5.0), F, F)],
)
def test_one_clamped_edge_or_two_supported_ones_hold_it(edges):
    fe.deflect(fe.Plate(SIZE, 1.0, 3000.0, 0.3, edges), [fe.Touch(50.0, 40.0, 1.0)])


@pytest.mark.parametrize("spring", [-1.0, float("nan")])
def test_a_spring_is_not_negative(spring):
    with pytest.raises(ValueError, match=r"^rotation spring of an edge must be 0 or more, got"):
        fe.Elastic(1.0, spring)


def test_what_is_not_an_edge_is_refused():
    with pytest.raises(ValueError, match=r"^east edge must be Clamped\(\), Supported\(\)"):
        fe.Edges(C, "clamped", C, C)  # pyright: ignore[reportArgumentType]

"""A plate under tension against Navier's series and buckling loads, and one on uneven springs."""

import dataclasses
from math import inf, log, pi

import numpy as np
import pytest
from scipy.integrate import quad

import fe
from fe.linear.energy import stiffness

C, S = fe.Clamped(), fe.Supported()
SIZE = (100.0, 80.0)
HINGED = fe.Plate(SIZE, 1.2, 3000.0, 0.3, S)
MESH = fe.Mesh(SIZE, (50, 40))
UNIT = pi**2 * HINGED.rigidity / SIZE[1] ** 2


def changed(plate, **changes):
    return dataclasses.replace(plate, **changes)


def waves(terms):
    m, n = np.meshgrid(np.arange(1, terms + 1), np.arange(1, terms + 1), indexing="ij")
    return m * pi / SIZE[0], n * pi / SIZE[1]


def stiffnesses(plate, terms):
    """Of the products of sines on hinges, (terms, terms), N/mm³."""
    (p, q), (xx, yy, _) = waves(terms), plate.tension
    return plate.rigidity * (p**2 + q**2) ** 2 + xx * p**2 + yy * q**2


def navier(plate, load, at, terms=2000):
    """Deflection for 1 N along z and curvatures xx, yy, xy, by Navier's series."""
    p, q = waves(terms)
    area = SIZE[0] * SIZE[1]
    each = 4 / area / stiffnesses(plate, terms)
    each = each * np.sin(p * load[0]) * np.sin(q * load[1])
    sx, sy, cx, cy = np.sin(p * at[0]), np.sin(q * at[1]), np.cos(p * at[0]), np.cos(q * at[1])
    sums = each * sx * sy, -each * p**2 * sx * sy, -each * q**2 * sx * sy, each * p * q * cx * cy
    w, *curvature = (float(part.sum()) for part in sums)
    return w, np.array(curvature)


@pytest.mark.parametrize("tension", [(0.0, 0.0, 0.0), (40.0, 9.0, 0.0), (-1.2, 0.5, 0.0)])
def test_a_hinged_plate_under_tension_meets_the_series(tension):
    plate = changed(HINGED, tension=tension)
    linear, load = fe.Linear(plate, MESH), (37.0, 52.0)
    state, at = linear.deflect([fe.Touch(*load, 2.0)]), np.array([(70.0, 20.0), (12.0, 64.0)])
    truth = [navier(plate, load, place, 800) for place in at]
    under = navier(plate, load, load)[0]
    assert state.deflection(at) == pytest.approx([-2 * w for w, _ in truth], rel=1e-5)
    bent = 0.6 * 2 * np.array([curvature for _, curvature in truth])
    assert state.strain(at) == pytest.approx(bent, abs=2e-4 * np.abs(bent).max())
    assert fe.compliance(linear, [load])[0] == pytest.approx(under, rel=4e-5)  # 2.1e-5


@pytest.mark.parametrize("tension", [(0.8, 2.5, 0.0), (-1.0, -0.3, 0.0)])
def test_modes_of_a_hinged_plate_under_tension_are_sines(tension):
    plate = changed(HINGED, tension=tension)
    truth = np.sort(stiffnesses(plate, 12).ravel())[:12]
    assert fe.modes(plate, 12, MESH).stiffness == pytest.approx(truth, rel=1e-4)


def test_both_ways_to_the_modes_know_the_tension():
    clamped = changed(HINGED, edges=C, tension=(0.8, -0.5, 0.0))
    # A patch of the material of the plate sends it the other way.
    patch = fe.Patch((0.0, 100.0), (0.0, 80.0), 1.2, 3000.0)
    one, other = (
        fe.modes(plate, 8, MESH).stiffness
        for plate in (clamped, changed(clamped, patches=(patch,)))
    )
    assert one == pytest.approx(other, rel=2e-5)
    plain = fe.modes(changed(clamped, tension=(0.0, 0.0, 0.0)), 8, MESH).stiffness
    assert np.abs(one / plain - 1).max() > 0.01


def test_shear_at_rest_bends_modes_along_its_diagonal():
    sheared = changed(HINGED, edges=C, tension=(0.0, 0.0, 0.8))
    ways = [changed(sheared, tension=(0.0, 0.0, t)) for t in (0.8, -0.8, 0.0)]
    one, other, plain = (fe.modes(plate, 6, MESH) for plate in ways)
    assert one.stiffness == pytest.approx(other.stiffness, rel=1e-9)
    assert one.stiffness[0] < plain.stiffness[0]
    at, mirrored = np.array([[70.0, 60.0]]), np.array([[70.0, 20.0]])
    assert abs(one.value(at)[0, 0]) > abs(one.value(mirrored)[0, 0])
    assert abs(other.value(at)[0, 0]) < abs(other.value(mirrored)[0, 0])


@pytest.mark.parametrize(
    ("tension", "coefficient"),
    [
        # (m² b²/a² + n²)² / (m² b²/a² - n² Nyy / Nxx) of m, n half waves, least of all.
        ((-1.0, 0.0, 0.0), (0.64 + 1) ** 2 / 0.64),
        ((-1.0, -1.0, 0.0), 0.64 + 1),
        ((-1.0, 3.0, 0.0), (9 * 0.64 + 1) ** 2 / (9 * 0.64 - 3)),
    ],
)
def test_a_hinged_plate_buckles_at_the_load_of_the_textbook(tension, coefficient):
    factor = fe.buckling_factor(changed(HINGED, tension=tension))
    assert factor == pytest.approx(coefficient * UNIT, rel=5e-5)


def test_a_hinged_plate_twice_as_long_as_wide_buckles_in_shear():
    # Timoshenko & Gere, Theory of Elastic Stability, § 9.7: 6.6, here 6.55 of finer series.
    for sense in (1.0, -1.0):
        plate = fe.Plate((160.0, 80.0), 1.2, 3000.0, 0.3, S, tension=(0.0, 0.0, sense))
        assert fe.buckling_factor(plate) == pytest.approx(6.546 * UNIT, rel=2e-3)


def test_a_plate_that_is_pulled_does_not_buckle():
    assert fe.buckling_factor(HINGED) == inf
    assert fe.buckling_factor(changed(HINGED, tension=(2.0, 1.0, 1.0))) == inf


def test_a_plate_that_has_buckled_is_refused_with_its_load():
    plate = changed(HINGED, tension=(-1.01 * UNIT * 2.05**2, 0.0, 0.0))
    sentence = (
        r"^plate tension must press less than buckling does, got \(-3.107, 0, 0\) N/mm where "
    )
    for make in (
        lambda: fe.deflect(plate, [fe.Touch(50.0, 40.0, 1.0)], MESH),
        lambda: fe.modes(plate, 5, MESH),
    ):
        with pytest.raises(ValueError, match=sentence + r"\(-3.077, 0, 0\) N/mm is critical"):
            make()


def test_linear_theory_refuses_a_shape():
    bowed = changed(HINGED, shape=fe.Shape(0.2))
    for make in (lambda: fe.Linear(bowed, MESH), lambda: fe.modes(bowed, 5, MESH)):
        with pytest.raises(ValueError, match=r"^linear theory is that of a flat plate, got Shape"):
            make()


def test_a_plate_with_a_shape_is_one_for_the_large_theory():
    flat, bowed = (fe.linear_range(p, 0.1) for p in (HINGED, changed(HINGED, shape=fe.Shape(0.3))))
    assert (flat.theory, bowed.theory) == ("linear", "large")
    assert bowed.error > 5 * flat.error


def test_a_rigid_plate_on_uneven_springs_settles_as_a_body():
    """Springs on two edges: w = α + β x + γ y of least energy."""
    k, (a, b), load = {"west": (0.02, 0.5), "east": (0.03, -0.7)}, SIZE, (30.0, 55.0)
    edges = fe.Edges(
        fe.Elastic(k["west"][0], 0.0, taper=k["west"][1]),
        fe.Elastic(k["east"][0], 0.0, taper=k["east"][1]),
        fe.Free(),
        fe.Free(),
    )
    stone = fe.Plate(SIZE, 3.0, 3e9, 0.3, edges)
    state = fe.deflect(stone, [fe.Touch(*load, 1.0)], fe.Mesh(SIZE, (10, 8)))
    energy = np.zeros((3, 3))
    for (stiff, t), x in zip(k.values(), (0.0, a), strict=True):
        # ∫ sⁿ / (1 + t s) over -1 to 1.
        zero = log((1 + t) / (1 - t)) / t
        one = (2 - zero) / t
        two = -one / t
        moments = [zero, one, two]
        # In s, y = b (1 + s) / 2.
        rows = np.array([[1.0, 0.0], [x, 0.0], [b / 2, b / 2]])
        square = np.array([[moments[i + j] for j in range(2)] for i in range(2)])
        energy += stiff * b / 2 * rows @ square @ rows.T
    body = np.linalg.solve(energy, [-1.0, -load[0], -load[1]])
    at = np.array([[0.0, 0.0], [100.0, 80.0], [20.0, 70.0]])
    assert state.deflection(at) == pytest.approx(np.c_[np.ones(3), at] @ body, rel=2e-4)


@pytest.mark.parametrize("taper", [0.6, -0.9])
def test_energy_of_uneven_rotation_springs_is_their_integral(taper):
    """Of w = x (y/b)³, whose slope across the west edge is (y/b)³."""
    west = fe.Elastic(2.0, 30.0, taper=(0.0, taper, 0.0))
    mesh = fe.Mesh(SIZE, (8, 6))
    plates = [HINGED, changed(HINGED, edges=fe.Edges(west, S, S, S))]
    everything = np.ones(mesh.shape[0], dtype=bool), np.ones(mesh.shape[1], dtype=bool)
    plain, sprung = (stiffness(plate, mesh, everything) for plate in plates)
    x, y = mesh.nodes
    along_x, along_y = np.zeros(mesh.shape[0]), np.zeros(mesh.shape[1])
    along_x[0::2], along_x[1::2] = x, mesh.units[0]
    along_y[0::2], along_y[1::2] = (y / 80) ** 3, mesh.units[1] * 3 * y**2 / 80**3
    w = np.kron(along_x, along_y)
    truth, _ = quad(lambda v: 30 * (v / 80) ** 6 / (1 + taper * (v / 40 - 1)), 0, 80)
    assert w @ (sprung - plain) @ w == pytest.approx(truth, rel=1e-7)


def test_uneven_edges_turned_round_give_the_plate_turned_round():
    edge = fe.Elastic(3.0, 200.0, taper=(0.3, 0.8, 0.0))
    turned = dataclasses.replace(edge, taper=(-0.3, -0.8, 0.0))
    one = changed(HINGED, edges=fe.Edges(edge, S, turned, S))
    other = changed(HINGED, edges=fe.Edges(S, turned, S, edge))
    at, far = np.array([[22.0, 61.0]]), np.array([[78.0, 19.0]])
    here, there = fe.Linear(one, MESH), fe.Linear(other, MESH)
    w = here.deflect([fe.Touch(30.0, 50.0, 1.0)]).deflection(at)
    assert w == pytest.approx(there.deflect([fe.Touch(70.0, 30.0, 1.0)]).deflection(far), rel=1e-9)
    for solver, place in ((here, (0.0, 30.0)), (there, (100.0, 50.0))):
        soft = fe.compliance(solver, [place])
        yields = solver.deflect([fe.Touch(*place, 1.0)]).deflection([place])
        assert soft == pytest.approx(-yields, rel=2e-3)

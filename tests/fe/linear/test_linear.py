"""The clamped plate against closed series, its own convergence and the laws it must keep."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fe
from fe.elements.hermite import hermite_gram
from fe.linear.energy import bending_products

# Clamped square of side a under a load P: load and gauge in parts of the side, w D / (P a²) under
# the load, and the curvatures w,xx w,yy w,xy D / P at the gauge for w along the load. Computed
# with another code, by Fourier series with the singular part in closed form; two of its
# resolutions agree to 9e-12.
SQUARE = [
    (0.50, 0.50, 0.005612024020, 0.05, 0.05, 0.0030847812, 0.0030847812, 0.0039477063),
    (0.50, 0.50, 0.005612024020, 0.50, 0.05, -0.0030220542, 0.0920915285, 0.0),
    (0.50, 0.50, 0.005612024020, 0.95, 0.30, 0.0604749480, -0.0008194226, -0.0165689089),
    (0.25, 0.50, 0.003285543346, 0.05, 0.75, 0.0576292409, 0.0025525414, -0.0273085479),
    (0.25, 0.50, 0.003285543346, 0.25, 0.95, -0.0018027523, 0.0424404139, -0.0108859802),
]
EDGE_MOMENT = 0.125770542291  # at the middle of an edge, centre load, in parts of P

SIDE, FORCE = 100.0, 2.5
PLATE = fe.Plate((SIDE, SIDE), 1.2, 3000.0, 0.3)
OBLONG = fe.Plate((150.0, 100.0), 2.0, 3000.0, 0.38)
SMALL = fe.Linear(OBLONG, fe.Mesh(OBLONG.size, (30, 18)))


@pytest.fixture(scope="module")
def square():
    return fe.Linear(PLATE, fe.default_mesh(PLATE))


def relative_to_reference(solver, row):
    """Errors of the deflection and of the strains, in parts of the largest strain there."""
    load, w, gauge, k = row[:2], row[2], row[3:5], np.array(row[5:])
    state = solver.deflect([fe.Touch(load[0] * SIDE, load[1] * SIDE, FORCE)])
    place, gauge = SIDE * np.array([load]), SIDE * np.array([gauge])
    w = -w * FORCE * SIDE**2 / PLATE.rigidity
    strain = 0.5 * PLATE.thickness * k * FORCE / PLATE.rigidity
    error = (state.strain(gauge)[0] - strain) / np.abs(strain).max()
    return state.deflection(place)[0] / w - 1, error


@pytest.mark.parametrize("row", SQUARE)
def test_default_mesh_meets_the_series_of_the_clamped_square(square, row):
    w, strain = relative_to_reference(square, row)
    assert abs(w) < 8e-5  # measured 3.7e-5 and 6.2e-5
    assert np.abs(strain).max() < 1e-5  # measured 8.7e-6 in the corner, 2e-7 elsewhere


@pytest.mark.parametrize("row", SQUARE)
def test_a_mesh_of_unlike_elements_meets_it_too(row):
    w, strain = relative_to_reference(fe.Linear(PLATE, fe.Mesh(PLATE.size, (100, 60))), row)
    assert abs(w) < 1.5e-4
    assert np.abs(strain).max() < 1e-4


def test_compliance_meets_the_series_under_the_touch_itself(square):
    places = SIDE * np.array([row[:2] for row in SQUARE])
    truth = SIDE**2 / PLATE.rigidity * np.array([row[2] for row in SQUARE])
    np.testing.assert_allclose(fe.compliance(square, places), truth, rtol=5e-6)  # 1.4e-6


def test_strain_at_the_clamped_edge_is_that_of_the_edge_moment(square):
    strain = square.deflect([fe.Touch(50.0, 50.0, FORCE)]).strain([[50.0, 0.0], [100.0, 50.0]])
    truth = 0.5 * PLATE.thickness * EDGE_MOMENT * FORCE / PLATE.rigidity
    np.testing.assert_allclose(strain, [[0, truth, 0], [truth, 0, 0]], atol=1e-6 * truth)


def hencky(a, b, d, terms=60):
    """Centre deflection and mid-edge moments of a clamped a x b plate under a unit centre load.

    Hencky's superposition: double sines for the supported plate, and edge moments that undo the
    slopes of its edges as Lagrange multipliers; inner sums in closed form. Returns w / P in mm/N
    and the moments, in parts of P, in the middle of the edges y = 0 and x = 0.
    """
    odd = np.arange(1, 2 * terms, 2)
    sign = np.sin(odd * np.pi / 2)
    alpha, beta = odd * np.pi / a, odd * np.pi / b
    own_y, load_y = line_sums(alpha, b)
    own_x, load_x = line_sums(beta, a)
    cross = np.outer(alpha, beta) / (alpha[:, None] ** 2 + beta**2) ** 2
    matrix = np.block([[np.diag(own_y), cross], [cross.T, np.diag(own_x)]])
    right = np.concatenate([sign * load_y, sign * load_x])
    moments = np.linalg.solve(matrix, right)
    m = np.arange(1, 20001, 2)
    t = m * np.pi * b / (2 * a)
    supported = a**2 / (2 * np.pi**3 * d) * np.sum((np.tanh(t) - t * sech(t) ** 2) / m**3.0)
    w = supported - 4 / (a * b * d) * moments @ right
    return w, moments[:terms] @ sign / a, moments[terms:] @ sign / b


def sech(u):
    return 2 * np.exp(-u) / (1 + np.exp(-2 * u))


def line_sums(c, side):
    """Σ s²/(c² + s²)² and Σ s sin(s side/2)/(c² + s²)² over s = π/side, 3π/side, ..."""
    u = c * side / 2
    own = side / (8 * c) * np.tanh(u) + side**2 / 16 * sech(u) ** 2
    return own, side**2 / (16 * c) * np.tanh(u) * sech(u)


def test_the_series_of_the_oblong_plate_is_right_for_the_square():
    w, along_y, along_x = hencky(100.0, 100.0, 7.0)
    assert w * 7.0 / 1e4 == pytest.approx(SQUARE[0][2], rel=1e-8)
    assert [along_y, along_x] == pytest.approx([EDGE_MOMENT] * 2, rel=1e-5)


@pytest.mark.parametrize("sides", [(150.0, 100.0), (70.0, 100.0), (100.0, 240.0)])
def test_oblong_plates_meet_the_series(sides):
    plate = fe.Plate(sides, 1.5, 2500.0, 0.25)
    a, b = sides
    w, edge_y, edge_x = hencky(a, b, plate.rigidity)
    state = fe.deflect(plate, [fe.Touch(a / 2, b / 2, 1.0)])
    assert state.deflection([[a / 2, b / 2]])[0] == pytest.approx(
        -w, rel=2e-4
    )  # measured 0.5 to 1.6e-4
    lever = 0.5 * plate.thickness / plate.rigidity
    strain = state.strain([[a / 2, 0.0], [0.0, b / 2]])
    found = [strain[0, 1], strain[1, 0]]
    atol = 1e-5 * lever * max(edge_x, edge_y)
    np.testing.assert_allclose(found, [lever * edge_y, lever * edge_x], atol=atol)


def errors_on(counts, sides, read):
    """Largest error of what `read` takes from a state, on each mesh, against the finest one."""
    plate = fe.Plate(sides, 1.0, 3000.0, 0.3)
    touch = fe.Touch(0.5 * sides[0], 0.5 * sides[1], 1.0)
    found = [read(fe.deflect(plate, [touch], fe.Mesh(sides, n))) for n in counts]
    return [np.abs(f - found[-1]).max() for f in found[:-1]]


def test_deflection_converges_with_the_fourth_power_away_from_the_load():
    away = [[23.0, 31.0], [120.0, 20.0]]
    coarse, fine = errors_on(
        [(12, 8), (48, 32), (144, 96)], (150.0, 100.0), lambda s: s.deflection(away)
    )
    assert np.log2(coarse / fine) / 2 > 3.6


def test_strain_converges_with_the_fourth_power_away_from_the_load():
    away = [[23.0, 7.0], [120.0, 5.0], [0.0, 41.0]]
    coarse, fine = errors_on(
        [(24, 16), (48, 32), (144, 96)], (150.0, 100.0), lambda s: s.strain(away)
    )
    assert np.log2(coarse / fine) > 3.4


def test_deflection_under_the_load_converges_with_the_square():
    w = [
        relative_to_reference(fe.Linear(PLATE, fe.Mesh(PLATE.size, (n, n))), SQUARE[0])[0]
        for n in (16, 32, 64)
    ]
    rates = np.diff(-np.log2(np.abs(w)))
    assert np.all(np.abs(rates - 2) < 0.1), (w, rates)


inside_x = st.floats(0, OBLONG.size[0])
inside_y = st.floats(0, OBLONG.size[1])


@given(inside_x, inside_y, inside_x, inside_y)
@settings(max_examples=60)
def test_a_touch_at_p_moves_q_as_a_touch_at_q_moves_p(px, py, qx, qy):
    p, q = fe.Touch(px, py, 1.0), fe.Touch(qx, qy, 1.0)
    there = SMALL.deflect([p]).deflection([[qx, qy]])
    back = SMALL.deflect([q]).deflection([[px, py]])
    np.testing.assert_allclose(there, back, rtol=1e-9, atol=1e-14)


@given(inside_x, inside_y, st.floats(-5, 5), inside_x, inside_y, st.floats(-5, 5))
@settings(max_examples=30)
def test_touches_add_up(px, py, f, qx, qy, g):
    p, q = fe.Touch(px, py, f), fe.Touch(qx, qy, g)
    both, first, second = SMALL.deflect([p, q]), SMALL.deflect([p]), SMALL.deflect([q])
    np.testing.assert_allclose(both.values, first.values + second.values, atol=1e-12)


def test_no_touch_leaves_the_plate_flat():
    assert not SMALL.deflect([]).values.any()


def test_a_press_moves_the_plate_inward_shortens_its_face_there_and_stretches_it_at_the_edge():
    state = SMALL.deflect([fe.Touch(75.0, 50.0, 1.0)])
    assert state.deflection([[75.0, 50.0]])[0] < 0
    assert np.isnan(state.strain([[75.0, 50.0]])).all()
    disc = SMALL.deflect([fe.Touch(75.0, 50.0, 1.0, radius=20.0)])
    assert np.all(disc.strain([[75.0, 50.0]])[0, :2] < 0)
    assert state.strain([[75.0, 0.0]])[0, 1] > 0
    assert state.strain([[0.0, 50.0]])[0, 0] > 0
    # The face shortens under the finger: what lies right of it moves left.
    assert state.displacement([[90.0, 50.0]])[0, 0] < 0


def test_edges_neither_move_nor_turn():
    s = np.linspace(0, 1, 23)[:, None]
    edge = np.vstack(
        [
            s * [150.0, 0.0],
            s * [0.0, 100.0],
            [150.0, 0] + s * [0, 100.0],
            [0, 100.0] + s * [150.0, 0],
        ]
    )
    state = SMALL.deflect([fe.Touch(31.0, 77.0, 3.0)])
    assert np.abs(state.displacement(edge)).max() < 1e-14


def test_faces_move_along_the_turned_normal():
    state = SMALL.deflect([fe.Touch(31.0, 77.0, 3.0)])
    xy = np.array([[40.0, 60.0], [100.0, 22.0]])
    top, middle, bottom = (state.displacement(xy, face) for face in ("top", "middle", "bottom"))
    np.testing.assert_allclose(top[:, :2], -1.0 * state.slope(xy))
    np.testing.assert_allclose(bottom[:, :2], 1.0 * state.slope(xy))
    assert not middle[:, :2].any()
    assert np.all(top[:, 2] == bottom[:, 2])
    with pytest.raises(ValueError, match=r"^face must be one of top, middle, bottom, got 'back'"):
        state.displacement(xy, "back")


def test_strain_of_the_face_is_the_derivative_of_its_displacement():
    state = fe.deflect(OBLONG, [fe.Touch(31.0, 77.0, 3.0)])
    xy = np.array([[90.0, 30.0], [118.0, 61.0]])
    step, (right, up) = 1e-3, 1e-3 * np.eye(2)
    dx = (state.displacement(xy + right) - state.displacement(xy - right)) / (2 * step)
    dy = (state.displacement(xy + up) - state.displacement(xy - up)) / (2 * step)
    truth = np.column_stack([dx[:, 0], dy[:, 1], (dx[:, 1] + dy[:, 0]) / 2])
    np.testing.assert_allclose(state.strain(xy), truth, atol=3e-3 * np.abs(truth).max())


def test_exchanging_the_axes_exchanges_the_solution():
    turned = fe.Plate((100.0, 150.0), 2.0, 3000.0, 0.38)
    xy = np.array([[12.0, 81.0], [75.0, 3.0], [140.0, 99.0]])
    one = SMALL.deflect([fe.Touch(31.0, 77.0, 3.0)])
    other = fe.deflect(turned, [fe.Touch(77.0, 31.0, 3.0)], fe.Mesh(turned.size, (18, 30)))
    np.testing.assert_allclose(one.strain(xy), other.strain(xy[:, ::-1])[:, [1, 0, 2]], rtol=1e-8)
    np.testing.assert_allclose(one.deflection(xy), other.deflection(xy[:, ::-1]), rtol=1e-8)


def test_mirrored_touches_bend_the_plate_mirrored():
    xy = np.array([[12.0, 81.0], [75.0, 3.0], [140.0, 99.0]])
    one = SMALL.deflect([fe.Touch(31.0, 77.0, 3.0)])
    other = SMALL.deflect([fe.Touch(150.0 - 31.0, 77.0, 3.0)])
    mirrored = other.strain(xy * [-1, 1] + [150.0, 0]) * [1, 1, -1]
    np.testing.assert_allclose(one.strain(xy), mirrored, rtol=1e-8)


def test_the_edges_carry_force_and_moments_of_the_touches():
    touches = [fe.Touch(31.0, 77.0, 3.0), fe.Touch(120.5, 20.2, -1.1)]
    mesh, values = SMALL.mesh, SMALL.deflect(touches).values
    stiffness = OBLONG.rigidity * bending_products(
        OBLONG.poisson,
        lambda p, q: hermite_gram(mesh.lines[0], p, q).toarray(),
        lambda p, q: hermite_gram(mesh.lines[1], p, q).toarray(),
        np.kron,
    )
    reaction = (stiffness @ values.ravel()).reshape(mesh.shape)
    reaction[2:-2, 2:-2] = 0
    # Unknowns (value, slope times h) of 1, x and y along a line.
    one = [np.tile([1.0, 0.0], n + 1) for n in mesh.counts]
    ramp = [
        np.repeat(np.arange(n + 1) * h, 2) for n, h in zip(mesh.counts, mesh.units, strict=True)
    ]
    for line, h in zip(ramp, mesh.units, strict=True):
        line[1::2] = h
    f, x, y = np.array([(t.force, t.x, t.y) for t in touches]).T
    assert one[0] @ reaction @ one[1] == pytest.approx(f.sum(), rel=1e-8)
    assert ramp[0] @ reaction @ one[1] == pytest.approx(f @ x, rel=1e-8)
    assert one[0] @ reaction @ ramp[1] == pytest.approx(f @ y, rel=1e-8)


@pytest.mark.slow
def test_a_state_says_what_its_material_does_not_bear():
    """Even pressure strains the clamped strip by 6 p (b/h)²/12 over E at its long sides."""
    strip = fe.Plate((900.0, 60.0), 1.0, 3000.0, 0.0, strain_limit=0.01)
    bears = 0.01 * 3000.0 / (0.5 * 60.0**2)
    for part, said in ((0.95, ""), (1.05, "strained beyond its limit")):
        state = fe.deflect(strip, [], loads=[fe.Pressure(part * bears)])
        assert state.demand == pytest.approx(part, rel=0.01)
        assert said in state.caution
        assert bool(state.caution) == bool(said)

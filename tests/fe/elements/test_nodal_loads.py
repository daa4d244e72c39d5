"""Pressure, line loads, pushes and moments against Navier's series and a rod."""

import numpy as np
import pytest

import fe
from fe.shell.meshes import pressed_mesh

SIZE = (120.0, 90.0)
PLATE = fe.Plate(SIZE, 1.0, 3000.0, 0.3, fe.Supported())
MESH = fe.even_grid(PLATE, 40)
PLACES = np.array([(31.0, 22.0), (60.0, 45.0), (95.0, 70.0)])
TERMS = np.arange(1, 200)


def navier(of_x, of_y):
    """Deflection at `PLACES` of a supported plate, of a load whose terms are a sum of products."""
    stiffness = 3000.0 / (12 * (1 - 0.3**2))
    k, m = np.pi * TERMS / SIZE[0], np.pi * TERMS / SIZE[1]
    load = 4 / (SIZE[0] * SIZE[1]) * np.einsum("qi,qj->ij", of_x, of_y)
    terms = load / (stiffness * (k[:, None] ** 2 + m**2) ** 2)
    x, y = np.sin(np.outer(PLACES[:, 0], k)), np.sin(np.outer(PLACES[:, 1], m))
    return np.einsum("pi,ij,pj->p", x, terms, y)


def sines(at, side):
    return np.sin(np.pi * np.outer(np.atleast_1d(at), TERMS) / side)


def means(low, high, side):
    """Integral of the sines over an interval, (1, terms)."""
    k = np.pi * TERMS / side
    return ((np.cos(k * low) - np.cos(k * high)) / k)[None]


def deflection(*loads):
    return fe.deflect(PLATE, [], MESH, loads).deflection(PLACES)


def test_pressure_on_the_plate_and_on_a_rectangle_is_that_of_navier():
    whole = -0.002 * navier(means(0, SIZE[0], SIZE[0]), means(0, SIZE[1], SIZE[1]))
    np.testing.assert_allclose(deflection(fe.Pressure(0.002)), whole, rtol=1e-4)
    part = -0.01 * navier(means(13.7, 50.2, SIZE[0]), means(40.1, 71.9, SIZE[1]))
    found = deflection(fe.Pressure(0.01, (13.7, 50.2), (40.1, 71.9)))
    np.testing.assert_allclose(found, part, rtol=1e-4)


def test_a_line_load_is_that_of_navier_along_a_slant():
    s, parts = np.polynomial.legendre.leggauss(60)
    x, y = 20.3 + 35.1 * (s + 1), 65.2 - 20.4 * (s + 1)
    of_x = 0.5 * parts[:, None] * sines(x, SIZE[0])
    found = deflection(fe.LineLoad((20.3, 65.2), (90.5, 24.4), 3.0))
    np.testing.assert_allclose(found, -3.0 * navier(of_x, sines(y, SIZE[1])), rtol=1e-4)


def test_a_moment_is_a_pair_of_forces_by_the_right_hand():
    k = np.pi * TERMS / SIZE[0]
    about_y = navier(-k * np.cos(k * 44.4)[None], sines(33.3, SIZE[1]))
    np.testing.assert_allclose(
        deflection(fe.PointMoment(44.4, 33.3, 0.0, 5.0)), 5.0 * about_y, rtol=2e-3
    )
    m = np.pi * TERMS / SIZE[1]
    about_x = navier(sines(44.4, SIZE[0]), m * np.cos(m * 33.3)[None])
    np.testing.assert_allclose(
        deflection(fe.PointMoment(44.4, 33.3, 5.0, 0.0)), 5.0 * about_x, rtol=2e-3
    )


def test_a_force_along_the_face_stretches_a_strip_as_a_rod_and_bends_it_by_its_arm():
    """Truth: a bar fixed at both ends is pulled by F L/(4 E A) in its middle."""
    edges = fe.Edges(west=fe.Clamped(), east=fe.Clamped(), south=fe.Free(), north=fe.Free())
    strip = fe.Plate((80.0, 12.0), 0.8, 3000.0, 0.0, edges)
    mesh = fe.Mesh((80.0, 12.0), (40, 6))
    pull = fe.LineLoad((40.0, 0.0), (40.0, 12.0), 0.0, along_x=0.02)
    state = fe.solve(strip, [], mesh=mesh, loads=[pull])
    # A force so small that slopes stretch nothing, read half-way to the clamps: in its middle the
    # rod has a kink, which no smooth function has.
    stretched = 0.5 * 0.02 * 80.0 / (4 * 3000.0 * 12.0 * 0.8)
    u = state.displacement(np.array([(20.0, 6.0), (60.0, 6.0)]), "middle")[:, 0]
    np.testing.assert_allclose(u, stretched, rtol=1e-3)
    # The moment F h/2 about y in the middle of a beam turns it by M L/(16 E I).
    turned = 0.02 * 0.4 * 80.0 / (16 * 3000.0 * 12.0 * 0.8**3 / 12)
    slope = np.diff(state.deflection(np.array([(39.9, 6.0), (40.1, 6.0)])))[0] / 0.2
    assert -slope == pytest.approx(turned, rel=0.02)


def test_strain_at_a_moment_is_not_a_number_and_under_pressure_it_is():
    loads = (fe.PointMoment(60.0, 45.0, 1.0, 0.0), fe.Pressure(0.001))
    state = fe.deflect(PLATE, [], MESH, loads)
    assert np.isnan(state.strain([(60.0, 45.0)])).all()
    assert np.isfinite(state.strain([(30.0, 20.0)])).all()
    assert np.isfinite(state.mesh_error([(30.0, 20.0)]).deflection).all()


def test_strain_of_a_shell_at_a_moment_and_a_force_along_the_face_is_not_a_number():
    loads = (fe.PointMoment(60.0, 45.0, 1.0, 0.0), fe.FaceForce(90.0, 20.0, 0.5, 0.0))
    state = fe.solve(PLATE, [], mesh=fe.even_grid(PLATE, 20), loads=(*loads, fe.Pressure(1e-4)))
    assert np.isnan(state.strain([(60.0, 45.0), (90.0, 20.0)])).all()
    assert np.isfinite(state.strain([(30.0, 20.0)])).all()
    assert np.isfinite(state.stability.demand)


def test_the_error_of_a_shells_mesh_under_loads_is_that_to_a_finer_mesh():
    touch, pressure = fe.Touch(80.0, 60.0, 0.2), fe.Pressure(5e-4)
    look = np.random.default_rng(3).uniform((5.0, 5.0), (60.0, 85.0), (80, 2))

    def solved(side):
        return fe.solve(PLATE, [touch], mesh=fe.even_grid(PLATE, side), loads=[pressure])

    state = solved(14)
    off = np.abs(state.deflection(look) - solved(28).deflection(look)).max()
    assert off / 3 < state.mesh_error(look).deflection.max() < 3 * off


@pytest.mark.slow
def test_the_error_of_a_mesh_is_not_known_under_bare_nodal_loads():
    touch, ready = fe.Touch(60.0, 45.0, 0.5), fe.Shell(PLATE, MESH)
    bare = fe.nodal_loads(PLATE, MESH, [fe.Pressure(1e-4)])
    beside = ready.undeformed.load(bare)
    for state in (beside, beside.touch([touch])):
        with pytest.raises(ValueError, match="got nodal loads beside them"):
            state.mesh_error([(30.0, 20.0)])
    nothing_more = ready.undeformed.touch([touch]).touch([])
    assert np.isfinite(nothing_more.mesh_error([(30.0, 20.0)]).deflection).all()


LONG = fe.Plate((1600.0, 100.0), 1.0, 3000.0, 0.3)
AROUND = np.array([(707.0, 37.0), (695.0, 46.0), (719.0, 30.0)])


@pytest.mark.slow
def test_a_touch_on_a_long_plate_is_resolved_beside_loads_as_well_as_alone():
    """Loads add up in linear theory."""
    touch, pressure = fe.Touch(700.0, 37.0, 1.0), fe.Pressure(1e-4)
    both = fe.deflect(LONG, [touch], loads=[pressure]).strain(AROUND)
    alone = fe.deflect(LONG, [touch]).strain(AROUND)
    rest = fe.deflect(LONG, [], loads=[pressure]).strain(AROUND)
    assert np.abs(both - alone - rest).max() < 1e-3 * np.abs(alone).max()


@pytest.mark.slow
def test_the_mesh_of_a_shell_is_fine_at_touches_and_edges_beside_loads():
    """Bent in linear theory; a grid that knows no touch is too coarse to say."""
    touch = fe.Touch(700.0, 37.0, 1.0)
    loads = [fe.LineLoad((800.0, 30.0), (850.0, 60.0), 1.0), fe.Pressure(1e-4)]
    look = np.concatenate([AROUND, [(800.0, 0.0), (707.0, 0.0)]])
    mesh = pressed_mesh(LONG, [touch], loads)
    shells, fine = (fe.deflect(LONG, [touch], m, loads).strain(look) for m in (mesh, None))
    assert np.abs(shells - fine).max() < 2e-3 * np.abs(fine).max()


def test_loads_that_cannot_be_are_one_sentence():
    with pytest.raises(ValueError, match="linear theory bends the plate and does not stretch it"):
        deflection(fe.FaceForce(10.0, 10.0, 1.0, 0.0))
    with pytest.raises(ValueError, match="end of a line load"):
        deflection(fe.LineLoad((10.0, 10.0), (130.0, 10.0), 1.0))
    with pytest.raises(ValueError, match="from a smaller to a larger x"):
        fe.Pressure(0.1, x=(30.0, 20.0))
    with pytest.raises(ValueError, match="use a Touch"):
        fe.LineLoad((1.0, 2.0), (1.0, 2.0), 1.0)
    with pytest.raises(ValueError, match="point moment about_x must be finite"):
        fe.PointMoment(1.0, 2.0, float("nan"), 0.0)


@pytest.mark.slow
def test_friction_turns_the_plate_as_a_touch_that_lies_aside_would():
    """By half the thickness times the coefficient: docs/limits.md says so."""
    force, friction = 1e-3, 0.2

    def deep(x, *loads):
        touch = fe.Touch(x, 40.0, force)
        return fe.solve(PLATE, [touch], mesh=MESH, loads=loads).displacement(PLACES)[:, 2]

    rubbed = deep(70.0, fe.FaceForce(70.0, 40.0, friction * force, 0.0))
    aside, straight = deep(70.0 + 0.5 * PLATE.thickness * friction), deep(70.0)
    assert np.abs(rubbed - straight).max() > 1e-3 * np.abs(straight).max()
    np.testing.assert_allclose(rubbed - straight, aside - straight, rtol=0.05)

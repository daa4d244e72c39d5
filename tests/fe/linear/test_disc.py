"""Touches that press on a disc, gauges that average over a length, faces and displacements."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fe

PLATE = fe.Plate((90.0, 60.0), 1.5, 3000.0, 0.38)
MESH = fe.Mesh(PLATE.size, (60, 40))
GAUGES = np.array([[5.0, 30.0], [50.0, 55.0], [33.3, 12.1]])
SOLVER = fe.Linear(PLATE, MESH)
INFLUENCE = fe.influence(PLATE, GAUGES, MESH)


def test_a_disc_bends_the_rest_of_the_plate_as_the_mean_over_it_says():
    # The deflection far away is biharmonic in the place of the touch: its mean over a disc of
    # radius c is the value in the middle and c²/8 of the Laplacian there, nothing else.
    middle, far, c = (45.0, 30.0), (80.0, 20.0), 8.0
    point, disc = (SOLVER.deflect([fe.Touch(*middle, 1.0, r)]) for r in (0.0, c))
    other = SOLVER.deflect([fe.Touch(*far, 1.0)]).strain([middle])[0]
    laplacian = other[:2].sum() / (-0.5 * PLATE.thickness)
    found = disc.deflection([far])[0] - point.deflection([far])[0]
    assert found == pytest.approx(c**2 / 8 * laplacian, rel=1e-4)


@given(x=st.floats(8.0, 82.0), y=st.floats(8.0, 52.0), radius=st.floats(0.0, 8.0))
@settings(max_examples=20)
def test_influence_of_a_disc_is_the_strain_under_it(x, y, radius):
    state = SOLVER.deflect([fe.Touch(x, y, 1.0, radius)])
    found = INFLUENCE.strain([[x, y]], radius)[0]
    near = state.near_touch(GAUGES)
    np.testing.assert_array_equal(INFLUENCE.near_gauge([[x, y]], radius)[0], near)
    direct, found = state.strain(GAUGES[~near]), found[~near]
    np.testing.assert_allclose(found, direct, atol=1e-9 * np.abs(direct).max())


def test_gradient_of_a_disc_is_the_derivative_of_its_strain():
    xy, step, radius = np.array([[41.0, 28.0], [60.0, 35.0]]), 1e-4, 6.0
    for axis in (0, 1):
        shift = step * np.eye(2)[axis]
        slope = INFLUENCE.strain(xy + shift, radius) - INFLUENCE.strain(xy - shift, radius)
        found = INFLUENCE.gradient(xy, radius)[..., axis]
        np.testing.assert_allclose(found, slope / (2 * step), atol=1e-6 * np.abs(found).max())


def test_a_disc_over_the_edge_is_refused():
    sentence = r"^touch disc of radius 6 mm at \(5, 30\) mm must lie on the plate, got 5 mm"
    with pytest.raises(ValueError, match=sentence):
        SOLVER.deflect([fe.Touch(5.0, 30.0, 1.0, 6.0)])
    with pytest.raises(ValueError, match=r"^touch radius must be 0 mm or more"):
        fe.Touch(5.0, 30.0, 1.0, -1.0)


def test_a_gauge_of_a_length_reads_the_mean_strain_over_its_square():
    length = 4.7
    long = fe.influence(PLATE, GAUGES, MESH, length=length).strain([[61.0, 30.0]])[0]
    nodes, weights = np.polynomial.legendre.leggauss(24)
    offset = 0.5 * length * nodes
    dx, dy = np.meshgrid(offset, offset, indexing="ij")
    fraction = 0.25 * np.outer(weights, weights).ravel()
    state = SOLVER.deflect([fe.Touch(61.0, 30.0, 1.0)])
    for gauge, read in zip(GAUGES, long, strict=True):
        points = gauge + np.column_stack([dx.ravel(), dy.ravel()])
        truth = fraction @ state.strain(points)
        np.testing.assert_allclose(read, truth, atol=3e-4 * np.abs(long).max())


def test_a_gauge_of_a_length_reads_the_difference_of_displacements_across_it():
    length = 10.0
    plate = fe.Plate(PLATE.size, 1.5, 3000.0, 0.38, fe.Supported())
    gauge = np.array([[40.0, 20.0]])
    read = fe.influence(plate, gauge, MESH, length=length).strain([[61.0, 30.0]])[0, 0]
    y = 20.0 + 5.0 * np.polynomial.legendre.leggauss(30)[0]
    w = 0.5 * np.polynomial.legendre.leggauss(30)[1]
    state = fe.deflect(plate, [fe.Touch(61.0, 30.0, 1.0)], MESH)
    u = [state.displacement(np.column_stack([np.full(30, x), y]))[:, 0] for x in (35.0, 45.0)]
    assert read[0] == pytest.approx(w @ (u[1] - u[0]) / length, rel=1e-8)


def test_a_gauge_that_reaches_over_the_edge_or_a_border_is_refused():
    with pytest.raises(ValueError, match=r"^gauge 0 of length 11 mm must lie on the plate"):
        fe.influence(PLATE, GAUGES, MESH, length=11.0)
    patch = fe.Patch((30.0, 60.0), (0.0, 60.0), 3.0, 3000.0)
    patched = fe.Plate(PLATE.size, 1.5, 3000.0, 0.38, patches=(patch,))
    with pytest.raises(ValueError, match=r"^gauge 2 of length 8 mm must not reach over a change"):
        fe.influence(patched, GAUGES, length=8.0)


def test_the_bottom_face_is_strained_the_other_way():
    top, bottom = (fe.influence(PLATE, GAUGES, MESH, face=face) for face in ("top", "bottom"))
    np.testing.assert_array_equal(top.adjoint.values, -bottom.adjoint.values)


def test_places_are_read_on_the_touched_face_where_no_face_is_named():
    for prepare in (fe.influence, fe.displacement_influence):
        plain, top = prepare(PLATE, GAUGES, MESH), prepare(PLATE, GAUGES, MESH, face="top")
        np.testing.assert_array_equal(plain.adjoint.values, top.adjoint.values)
    u, v, w = fe.displacement_influence(PLATE, [[60.0, 30.0]], MESH).displacement([[45.0, 30.0]])[
        0, 0
    ]
    # Under a press the touched face shortens towards it, and the plate goes down.
    assert u < 0
    assert abs(v) < 1e-12
    assert w < 0


@pytest.mark.parametrize("face", ["top", "middle", "bottom"])
def test_displacement_influence_is_the_displacement_under_a_touch(face):
    one = fe.displacement_influence(PLATE, GAUGES, MESH, face=face)
    other = fe.DisplacementInfluence.from_arrays(one.arrays())
    direct = SOLVER.deflect([fe.Touch(44.4, 21.0, 1.0)]).displacement(GAUGES, face)
    for found in (one, other):
        read = found.displacement([[44.4, 21.0]])[0]
        np.testing.assert_allclose(read, direct, rtol=1e-8, atol=1e-14)
    step = 1e-4
    slope = one.displacement([[44.4, 21.0 + step]]) - one.displacement([[44.4, 21.0 - step]])
    gradient = one.gradient([[44.4, 21.0]])[..., 1]
    np.testing.assert_allclose(gradient, slope / (2 * step), atol=1e-7 * np.abs(gradient).max())


@pytest.mark.parametrize(
    "edges", [fe.Clamped(), fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())]
)
def test_modes_of_any_edges_carry_the_deflection_of_a_disc(edges):
    plate = fe.Plate(PLATE.size, 1.5, 3000.0, 0.38, edges)
    mesh = fe.Mesh(plate.size, (36, 24))
    modes = fe.modes(plate, 150, mesh)
    far = np.array([[20.0, 20.0], [80.0, 55.0]])
    truth = fe.deflect(plate, [fe.Touch(50.0, 33.0, 1.0, 7.0)], mesh).deflection(far)
    found = modes.response([[50.0, 33.0]], 7.0)[0] @ modes.value(far).T
    np.testing.assert_allclose(found, truth, atol=1e-3 * np.abs(truth).max())

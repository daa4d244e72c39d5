"""Vibration modes: known frequencies, their own definition, the deflection they sum to."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, eigsh

import fe
from fe.elements.hermite import hermite_gram

PLATE = fe.Plate((150.0, 100.0), 2.0, 3000.0, 0.38)
MESH = fe.Mesh(PLATE.size, (48, 32))
POINTS = np.random.default_rng(3).uniform((0, 0), PLATE.size, (30, 2))


@pytest.fixture(scope="module")
def modes():
    return fe.modes(PLATE, 120, MESH)


def test_the_clamped_square_sounds_as_known():
    # ω a² sqrt(ρ h / D); the first is 35.985 in Leissa's Vibration of Plates (1969) and since.
    plate = fe.Plate((100.0, 100.0), 1.0, 3000.0, 0.3)
    stiffness = fe.modes(plate, 6).stiffness
    found = np.sqrt(stiffness / plate.rigidity) * 100.0**2
    np.testing.assert_allclose(
        found, [35.985, 73.394, 73.394, 108.217, 131.581, 132.205], atol=6e-4
    )


def test_stiffnesses_are_those_of_the_sparse_problem_on_the_same_mesh(modes):
    solver = fe.Linear(PLATE, MESH)
    inside = slice(2, -2)
    mass = sp.kron(*(hermite_gram(line, 0, 0)[inside, inside] for line in MESH.lines))
    inverse = LinearOperator(
        mass.shape, matvec=lambda v: solver.factor.solve(v[:, None])[:, 0], dtype=np.float64
    )
    # Without the matrix itself: in this mode the solver needs its inverse and the mass alone.
    stiffness = LinearOperator(mass.shape, matvec=lambda v: v, dtype=np.float64)
    start = np.random.default_rng(5).standard_normal(mass.shape[0])
    truth = eigsh(
        stiffness, 120, mass.tocsc(), sigma=0.0, OPinv=inverse, v0=start, return_eigenvectors=False
    )
    error = modes.stiffness / np.sort(truth) - 1
    assert error.min() > -1e-8  # Ritz's values lie above
    assert error.max() < 1e-4
    assert np.median(error) < 1e-5


def test_modes_are_orthonormal_over_the_area(modes):
    mass = [hermite_gram(line, 0, 0).toarray() for line in MESH.lines]
    product = np.einsum("abk,ac,bd,cdl->kl", modes.values, *mass, modes.values, optimize=True)
    np.testing.assert_allclose(product, np.eye(120), atol=1e-9)


def test_slopes_and_curvatures_are_the_derivatives_of_the_values(modes):
    xy, step = POINTS[:5], 1e-4
    for axis, (same, mixed) in enumerate([(0, 2), (1, 2)]):
        shift = step * np.eye(2)[axis]
        value = (modes.value(xy + shift) - modes.value(xy - shift)) / (2 * step)
        slope = (modes.slope(xy + shift) - modes.slope(xy - shift)) / (2 * step)
        np.testing.assert_allclose(modes.slope(xy)[..., axis], value, atol=1e-9)
        np.testing.assert_allclose(modes.curvature(xy)[..., same], slope[..., axis], atol=1e-9)
        np.testing.assert_allclose(modes.curvature(xy)[..., mixed], slope[..., 1 - axis], atol=1e-9)


def test_response_and_gradient_are_values_and_slopes_over_stiffness(modes):
    np.testing.assert_allclose(modes.response(POINTS), -modes.value(POINTS) / modes.stiffness)
    np.testing.assert_allclose(
        modes.gradient(POINTS), -modes.slope(POINTS) / modes.stiffness[:, None]
    )


def test_their_sum_is_the_deflection(modes):
    touch = fe.Touch(31.0, 77.0, 2.0)
    truth = fe.deflect(PLATE, [touch], MESH).deflection(POINTS)
    q = touch.force * modes.response([[touch.x, touch.y]])[0]
    missed = modes.value(POINTS) @ q - truth
    assert np.sqrt(np.mean(missed**2)) < 2e-3 * np.abs(truth).max()  # measured 1e-3


@pytest.mark.parametrize("count", [60, 120, pytest.param(240, marks=pytest.mark.slow)])
def test_what_modes_miss_under_the_touch_falls_with_their_number(count):
    # By Weyl's law λ_k -> D (4 π k / A)², and φ² is 1/A in the mean, so that what N modes leave
    # out of the deflection under a touch of 1 N is A / (16 π² D N).
    modes = fe.modes(PLATE, count)
    from_edge = np.minimum(POINTS, np.array(PLATE.size) - POINTS).min(axis=1)
    inside = POINTS[from_edge > 20]
    solver = fe.Linear(PLATE, modes.mesh)
    missed = []
    for place, q in zip(inside, modes.response(inside), strict=True):
        full = solver.deflect([fe.Touch(*place, 1.0)]).deflection([place])[0]
        missed.append(full - q @ modes.value([place])[0])
    expected = -PLATE.area / (16 * np.pi**2 * PLATE.rigidity * count)
    assert np.mean(missed) / expected == pytest.approx(1.0, abs=0.25)


def test_modes_do_not_depend_on_the_run():
    one, two = fe.modes(PLATE, 30, MESH), fe.modes(PLATE, 30, MESH)
    np.testing.assert_array_equal(one.values, two.values)


def test_progress_ends_at_the_whole():
    calls = []
    fe.modes(PLATE, 10, MESH, progress=lambda *call: calls.append(call))
    assert calls == [(1, 4), (2, 4), (3, 4), (4, 4)]


def test_modes_survive_a_file(modes):
    again = fe.Modes.from_arrays(modes.arrays())
    assert again.plate == PLATE
    assert again.mesh == MESH
    np.testing.assert_array_equal(again.response(POINTS), modes.response(POINTS))


@pytest.mark.parametrize(
    ("count", "sentence"),
    [
        (0, "number of modes must be at least 1"),
        (400, "a mesh of 12 by 8 elements carries at most 24 modes, got 400"),
    ],
)
def test_modes_that_a_mesh_cannot_carry_are_refused(count, sentence):
    with pytest.raises(ValueError, match="^" + sentence):
        fe.modes(PLATE, count, fe.Mesh(PLATE.size, (12, 8)))

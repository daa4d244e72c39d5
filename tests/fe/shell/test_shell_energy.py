"""Energy of the shell: derivatives, invariance, and the strain of its faces."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fe
from fe.shell.extended import forces
from fe.shell.measure import strain, strain_variation, turning
from fe.shell.system import System

OBLONG = fe.Plate((9.0, 7.0), 0.3, 1000.0, 0.3)


def energy(plate=OBLONG, counts=(7, 6)):
    return System(plate, fe.Mesh(plate.size, counts))


SYSTEM = energy()


def unknowns(system, displacement):
    """Table of a displacement (..., 2) mm -> (..., 3) with its derivatives by differences."""
    mesh = system.mesh
    x, y = np.meshgrid(*mesh.nodes, indexing="ij")
    at = np.stack([x, y], axis=-1)
    dx, dy, e = np.array([1.0, 0.0]), np.array([0.0, 1.0]), 1e-3
    table = np.empty((*mesh.shape, 3))
    table[0::2, 0::2] = displacement(at)
    table[1::2, 0::2] = (displacement(at + e * dx) - displacement(at - e * dx)) / (2 * e)
    table[0::2, 1::2] = (displacement(at + e * dy) - displacement(at - e * dy)) / (2 * e)
    table[1::2, 1::2] = 0.0
    table[1::2] *= mesh.units[0]
    table[:, 1::2] *= mesh.units[1]
    return table.ravel()


@settings(max_examples=10)
@given(seed=st.integers(0, 2**32 - 1), size=st.floats(0.01, 0.3), thin=st.floats(-3, 0))
def test_gradient_and_tangent_are_the_derivatives_of_the_energy(seed, size, thin):
    system = energy(fe.Plate((9.0, 7.0), 10**thin, 1000.0, 0.3))
    rng = np.random.default_rng(seed)
    length = 3 * system.mesh.shape[0] * system.mesh.shape[1]
    values, way = size * rng.standard_normal((2, length))
    e = 1e-5
    (over, gradient_over, _), (under, gradient_under, _) = (
        system.forces(values + s * way) for s in (e, -e)
    )
    gradient, tangent = system.forces(values)[1], system.tangent(values)
    assert (over - under) / (2 * e) == pytest.approx(gradient @ way, rel=1e-5)
    difference = (gradient_over - gradient_under) / (2 * e)
    change = tangent @ way
    assert np.abs(difference - change).max() < 1e-5 * np.abs(change).max()  # measured 4e-8
    assert abs(tangent - tangent.T).max() < 1e-12 * abs(tangent).max()


def test_forces_in_extended_precision_are_those_of_double_precision():
    edges = fe.Elastic(5.0, 200.0, 50.0)
    plate = fe.Plate(
        (9.0, 7.0), 0.3, 1000.0, 0.3, edges, shape=fe.Shape(0.2), tension=(1.0, 2.0, 0.3)
    )
    system = energy(plate)
    values = 0.1 * np.random.default_rng(0).standard_normal(system.at_rest.size)
    _, expected, size = system.forces(values)
    found, found_size = forces(system, values.astype(np.longdouble))
    np.testing.assert_allclose(found.astype(float), expected, atol=1e-12 * size.max())
    np.testing.assert_allclose(found_size, size, rtol=1e-9)


@settings(max_examples=10)
@given(
    axis=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    angle=st.floats(-3, 3),
    shift=st.tuples(*[st.floats(-100, 100)] * 3),
)
def test_a_rigid_motion_costs_nothing(axis, angle, shift):
    unit = np.array(axis) / np.linalg.norm(axis)
    cross = np.cross(np.eye(3), -unit)
    turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross

    def moved(xy):
        place = np.concatenate([xy, np.zeros((*xy.shape[:-1], 1))], axis=-1)
        return place @ (turn - np.eye(3)).T + np.array(shift)

    found, gradient, _ = SYSTEM.forces(unknowns(SYSTEM, moved))
    one_percent = 0.5 * 0.01**2 * OBLONG.young * OBLONG.thickness * OBLONG.area
    assert found < 1e-14 * one_percent
    assert np.abs(gradient).max() < 1e-8 * OBLONG.young * OBLONG.thickness


def test_even_stretch_costs_what_plane_stress_says():
    e = 0.02

    def pulled(xy):
        return np.stack([e * xy[..., 0], 0 * xy[..., 0], 0 * xy[..., 0]], axis=-1)

    found, _, _ = SYSTEM.forces(unknowns(SYSTEM, pulled))
    green = e + e**2 / 2
    stiffness = OBLONG.young * OBLONG.thickness / (1 - OBLONG.poisson**2)
    assert found == pytest.approx(0.5 * stiffness * green**2 * OBLONG.area, rel=1e-9)


def test_rolling_up_a_plate_costs_its_bending_alone():
    radius = 4.0
    plate = fe.Plate((9.0, 7.0), 0.3, 1000.0, 0.3)
    system = energy(plate, (24, 6))

    def rolled(xy):
        angle = xy[..., 0] / radius
        u, w = radius * np.sin(angle) - xy[..., 0], radius * (1 - np.cos(angle))
        return np.stack([u, 0 * u, w], axis=-1)

    found, _, _ = system.forces(unknowns(system, rolled))
    bending = 0.5 * plate.rigidity / radius**2 * plate.area
    assert found == pytest.approx(bending, rel=1e-5)


def bumpy(xy):
    """Stretch, shear and bend a plate somehow: displacement (..., 3) at points (..., 2)."""
    x, y = xy[..., 0], xy[..., 1]
    return np.stack(
        [0.1 * np.sin(x) * y, 0.2 * x * y - 0.05 * y**2, np.cos(0.7 * x) * np.sin(0.5 * y + 0.3)],
        axis=-1,
    )


def differences(function, xy, e=1e-3):
    """Five derivatives (K, 5, 3), errors of e⁴ but for rounding."""
    dx, dy = np.array([e, 0.0]), np.array([0.0, e])

    def first(f, d):
        return (8 * (f(xy + d) - f(xy - d)) - (f(xy + 2 * d) - f(xy - 2 * d))) / (12 * e)

    def second(d):
        near, far = (function(xy + s * d) + function(xy - s * d) for s in (1, 2))
        return (16 * near - far - 30 * function(xy)) / (12 * e**2)

    corners = [s * t * function(xy + s * dx + t * dy) for s in (1, -1) for t in (1, -1)]
    mixed = sum(corners) / (4 * e**2)
    parts = [first(function, dx), first(function, dy), second(dx), second(dy), mixed]
    return np.stack(parts, axis=1)


XY = np.random.default_rng(4).uniform(0.2, 2.0, (20, 2))
Z = np.linspace(-0.2, 0.2, 20)


def test_strain_of_a_face_is_the_green_lagrange_strain_of_its_displacement():
    def face(xy):
        g = differences(bumpy, xy)
        a1, a2 = g[:, 0] + [1, 0, 0], g[:, 1] + [0, 1, 0]
        normal = np.cross(a1, a2)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return bumpy(xy) + Z[:, None] * (normal - [0, 0, 1])

    e = 1e-3
    grad = [
        (face(XY + d) - face(XY - d)) / (2 * e) + flat
        for d, flat in ((np.array([e, 0]), [1, 0, 0]), (np.array([0, e]), [0, 1, 0]))
    ]
    metric = [np.einsum("kc,kc->k", grad[i], grad[j]) for i, j in ((0, 0), (1, 1), (0, 1))]
    truth = 0.5 * (np.stack(metric, axis=1) - [1, 1, 0])
    found = strain(differences(bumpy, XY), Z)
    assert np.abs(found - truth).max() < 1e-5 * np.abs(truth).max()  # measured 1e-6


def test_variation_of_the_strain_is_its_derivative():
    g = differences(bumpy, XY)
    rng = np.random.default_rng(5)
    way, e = rng.standard_normal(g.shape), 1e-6
    difference = (strain(g + e * way, Z) - strain(g - e * way, Z)) / (2 * e)
    change = np.einsum("kidc,kdc->ki", strain_variation(g, Z), way)
    np.testing.assert_allclose(difference, change, atol=1e-8 * np.abs(change).max())


def test_the_normal_turns_as_the_surface_bends():
    def normal(xy):
        g = differences(bumpy, xy)
        cross = np.cross(g[:, 0] + [1, 0, 0], g[:, 1] + [0, 1, 0])
        return cross / np.linalg.norm(cross, axis=1, keepdims=True)

    e = 1e-3
    ways = np.array([[e, 0], [0, e]])
    truth = np.stack([(normal(XY + d) - normal(XY - d)) / (2 * e) for d in ways], axis=1)
    assert np.abs(turning(differences(bumpy, XY)) - truth).max() < 1e-5

"""The elements: what they represent exactly, and the order to which curvature is recovered."""

import numpy as np
import pytest

import fe
from fe.elements.functional import derivative, recovered
from fe.elements.hermite import hermite_gram
from fe.linear.energy import bending_products

SIZE, COUNTS = (3.0, 2.0), (9, 7)
MESH = fe.Mesh(SIZE, COUNTS)
PLATE = fe.Plate(SIZE, 0.1, 12000.0, 0.3)
POINTS = np.random.default_rng(1).uniform((0, 0), SIZE, (40, 2))


def table(mesh, f, dx, dy, dxy):
    """Unknowns of a function given with its derivatives."""
    (hx, hy), (nx, ny) = mesh.units, mesh.counts
    x, y = np.meshgrid(
        np.linspace(0, mesh.size[0], nx + 1), np.linspace(0, mesh.size[1], ny + 1), indexing="ij"
    )
    values = np.empty((*mesh.shape, 1))
    values[0::2, 0::2, 0], values[1::2, 0::2, 0] = f(x, y), hx * dx(x, y)
    values[0::2, 1::2, 0], values[1::2, 1::2, 0] = hy * dy(x, y), hx * hy * dxy(x, y)
    return values


def power(mesh, m, n):
    """Unknowns of x^m y^n."""

    def d(k, s):
        return k * s ** max(k - 1, 0)

    return table(
        mesh,
        lambda x, y: x**m * y**n,
        lambda x, y: d(m, x) * y**n,
        lambda x, y: x**m * d(n, y),
        lambda x, y: d(m, x) * d(n, y),
    )


def falling(m, p):
    return np.prod(np.arange(m, m - p, -1, dtype=float))


@pytest.mark.parametrize("m", range(4))
@pytest.mark.parametrize("n", range(4))
@pytest.mark.parametrize(("p", "q"), [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2)])
def test_bicubic_functions_and_their_derivatives_are_exact(m, n, p, q):
    truth = np.zeros(len(POINTS))
    if p <= m and q <= n:
        truth = falling(m, p) * falling(n, q) * POINTS[:, 0] ** (m - p) * POINTS[:, 1] ** (n - q)
    found = derivative(MESH, POINTS, p, q).of(power(MESH, m, n))[:, 0]
    np.testing.assert_allclose(found, truth, atol=1e-11)


@pytest.mark.parametrize("m", range(6))
def test_recovered_curvature_of_a_quintic_is_exact_at_every_node_up_to_the_edges(m):
    x = np.linspace(0, SIZE[0], COUNTS[0] + 1)
    nodes = np.column_stack([x, np.full(len(x), 0.7)])
    truth = falling(m, 2) * x ** max(m - 2, 0)
    found = recovered(MESH, nodes, 2, 0).of(power(MESH, m, 0))[:, 0]
    np.testing.assert_allclose(found, truth, atol=1e-9)


@pytest.mark.parametrize(("p", "q"), [(2, 0), (0, 2), (1, 1)])
def test_recovered_curvature_converges_with_the_fourth_power_anywhere(p, q):
    def f(p, q):
        return lambda x, y: (
            np.real(1j**p * (1.3j) ** q * np.exp(1j * (x + 1.3 * y))) * np.ones_like(x)
        )

    errors = []
    for counts in ((12, 10), (24, 20), (48, 40)):
        mesh = fe.Mesh(SIZE, counts)
        values = table(mesh, f(0, 0), f(1, 0), f(0, 1), f(1, 1))
        truth = np.real(1j**p * 1.3j**q * np.exp(1j * (POINTS @ [1, 1.3])))
        errors.append(np.abs(recovered(mesh, POINTS, p, q).of(values)[:, 0] - truth).max())
    rates = np.log2(errors[:-1]) - np.log2(errors[1:])
    assert rates.min() > 3.6, (errors, rates)


def energy(values):
    matrix = PLATE.rigidity * bending_products(
        PLATE.poisson,
        lambda p, q: hermite_gram(MESH.lines[0], p, q).toarray(),
        lambda p, q: hermite_gram(MESH.lines[1], p, q).toarray(),
        np.kron,
    )
    return values.ravel() @ matrix @ values.ravel()


@pytest.mark.parametrize(("m", "n"), [(0, 0), (1, 0), (0, 1)])
def test_rigid_motion_costs_no_energy(m, n):
    assert abs(energy(power(MESH, m, n))) < 1e-9 * energy(power(MESH, 2, 0))


def test_uniform_bending_and_twist_cost_the_energy_of_the_textbook():
    area, d, nu = SIZE[0] * SIZE[1], PLATE.rigidity, PLATE.poisson
    assert energy(power(MESH, 2, 0)) == pytest.approx(4 * d * area, rel=1e-10)
    assert energy(power(MESH, 1, 1)) == pytest.approx(2 * (1 - nu) * d * area, rel=1e-10)
    sphere = power(MESH, 2, 0) + power(MESH, 0, 2)
    assert energy(sphere) == pytest.approx(8 * (1 + nu) * d * area, rel=1e-10)


def test_a_finer_mesh_divides_every_element():
    patch = fe.Patch((0.0, 1.2), (0.0, 2.0), 0.2, 12000.0)
    coarse = fe.grid(fe.Plate(SIZE, 0.1, 12000.0, 0.3, patches=(patch,)), 15)
    fine = fe.scaled_mesh(coarse, 3)
    assert fine.counts == tuple(3 * count for count in coarse.counts)
    assert fine.breaks == coarse.breaks
    for lines, thrice in zip(coarse.nodes, fine.nodes, strict=True):
        np.testing.assert_allclose(thrice[::3], lines)

"""A narrow shell against the rod that it is: cantilever under end shear and end moment."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import fe
from fe.hermite import gram
from fe.shell import Shell
from fe.shell.newton import equilibrium
from fe.shell.problem import Problem
from fe.shell.support import REST, Motion, Support, support

WIDTH, HEIGHT, YOUNG = 1.0, 0.1, 1.2e6
STIFFNESS = YOUNG * WIDTH * HEIGHT**3 / 12
FREE = fe.Free()


def rod(length, force):
    """End displacement (u, w) of a clamped rod under a dead end force along z.

    It stretches by λ and turns by θ, with energy EA (λ² - 1)² / 8 + EI (λ θ')² / 2 per length.
    """
    axial = YOUNG * WIDTH * HEIGHT

    def slopes(_, state):
        angle, moment = state[2], state[3]
        # Along the rod acts EA (λ² - 1) λ / 2 + EI λ θ'², with the moment EI λ² θ'.
        stretch = np.ones_like(angle)
        for _ in range(20):
            bent = moment**2 / (STIFFNESS * stretch**3)
            green = (force * np.sin(angle) - bent) / (axial * stretch)
            stretch = np.sqrt(1 + 2 * green)
        along, up = stretch * np.cos(angle), stretch * np.sin(angle)
        return np.stack([along, up, moment / (STIFFNESS * stretch**2), -force * along])

    def ends(left, right):
        return np.array([left[0], left[1], left[2], right[3]])

    s = np.linspace(0, length, 101)
    guess = np.stack([s, 0 * s, 0 * s, force * (length - s) / 10])
    solution = solve_bvp(slopes, ends, s, guess, tol=1e-10, max_nodes=20000)
    assert solution.success
    return solution.y[0, -1] - length, solution.y[1, -1]


def test_cantilever_under_end_shear_bends_like_the_rod():
    length, force = 10.0, 4.0
    plate = fe.Plate((length, WIDTH), HEIGHT, YOUNG, 0.0, fe.Edges(fe.Clamped(), FREE, FREE, FREE))
    shell = Shell(plate, fe.Mesh(plate.size, (24, 6)))
    one = np.tile([1.0, 0.0], 7)
    loads = np.zeros((*shell.mesh.shape, 3))
    loads[-2, :, 2] = force / WIDTH * (gram(shell.mesh.lines[1], 0, 0) @ one)
    state = shell.rest.load(loads)
    end = state.displacement([[length, WIDTH / 2]], face="middle")[0]
    assert state.stability.converged
    u, w = rod(length, force)
    assert (-u, w) == pytest.approx((3.2895436, 6.6998889), rel=1e-7)
    np.testing.assert_allclose(end[[0, 2]], [u, w], rtol=1e-4)  # measured 2e-6
    assert abs(end[1]) < 1e-9


def about_y(angle):
    c, s = np.cos(angle), np.sin(angle)
    return Motion(np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]), np.zeros(3))


def in_the_plane(held):
    """Hold the displacement along y as well: a ring that may leave its plane does so."""
    along_y = np.arange(held.free.shape[0]) % 3 == 1
    moving = abs(held.free[along_y]).sum(axis=0) == 0
    return Support(held.lift, held.free[:, moving])


def test_cantilever_under_end_moment_closes_to_a_circle():
    length = 12.0
    turned = fe.Elastic(deflection=0.0, rotation=np.inf, membrane=0.0)
    edges = fe.Edges(fe.Clamped(), turned, FREE, FREE)
    plate = fe.Plate((length, WIDTH), HEIGHT, YOUNG, 0.0, edges)
    shell = Shell(plate, fe.Mesh(plate.size, (30, 6)))
    values = shell.rest.values.ravel()
    for angle in np.linspace(0, 2 * np.pi, 9)[1:]:
        held = in_the_plane(support(plate, shell.mesh, REST, about_y(angle)))
        found = equilibrium(Problem(shell.system, held, np.zeros(len(values)), shell.unit), values)
        assert found.converged
        values = found.values
    end = shell.system.table(values)[-2, 0::2]
    np.testing.assert_allclose(end, np.broadcast_to([-length, 0, 0], end.shape), atol=1e-3 * length)
    moment = 2 * shell.system.forces(values)[0] / (2 * np.pi)
    assert moment == pytest.approx(50 * np.pi / 3, rel=1e-3)

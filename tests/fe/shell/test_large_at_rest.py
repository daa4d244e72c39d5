"""Tension, shape and uneven edges in large deflection: an arch by hand, shell and Karman."""

import dataclasses
from dataclasses import replace
from math import inf

import numpy as np
import pytest

import fe
from fe.elements.functional import derivative
from fe.reduced.karman import Karman
from fe.reduced.training import pressure
from fe.shell.system import System

C, S, F = fe.Clamped(), fe.Supported(), fe.Free()
SIZE = (90.0, 70.0)
PLATE = fe.Plate(SIZE, 1.0, 3000.0, 0.38)
BOWED = fe.Shape(0.6, ((0.0, 0.0, 0.1), (0.0, 0.08, 0.0)))
UNEVEN = fe.Edges(
    C,
    fe.Elastic(inf, 300.0, 40.0, taper=(0.0, 0.6, -0.7)),
    S,
    fe.Elastic(9.0, 0.0, 20.0, taper=0.5),
)
MESH = fe.Mesh(SIZE, (16, 12))


def changed(**changes):
    return dataclasses.replace(PLATE, **changes)


KINDS = {
    "pulled": changed(tension=(3.0, 1.0, 0.5)),
    "pressed": changed(tension=(-1.0, -1.5, 0.3)),
    "bowed": changed(shape=BOWED),
    "sunk and pulled": changed(shape=fe.Shape(-0.6), tension=(2.0, 2.0, 0.0)),
    "uneven": changed(edges=UNEVEN),
    "all": changed(edges=UNEVEN, shape=BOWED, tension=(0.5, 1.0, -0.2)),
}


@pytest.fixture(params=KINDS.values(), ids=list(KINDS))
def plate(request):
    return request.param


def test_the_plate_at_rest_is_in_balance(plate):
    shell = fe.Shell(plate, fe.Mesh(SIZE, (9, 7)))
    energy, gradient, size = shell.system.forces(np.zeros(shell.system.at_rest.size))
    assert energy < 1e-25
    assert np.abs(gradient).max() <= 1e-12 * np.abs(size).max()
    at = np.array([[30.0, 22.0], [61.0, 44.0]])
    assert np.abs(shell.undeformed.strain(at)).max() == 0
    assert np.abs(shell.undeformed.displacement(at)).max() == 0


def test_forces_and_tangent_are_the_derivatives_of_the_energy(plate):
    system, rng, e = System(plate, fe.Mesh(SIZE, (7, 6))), np.random.default_rng(3), 1e-5
    values, way = 0.3 * rng.standard_normal((2, system.at_rest.size))
    (over, gradient_over, _), (under, gradient_under, _) = (
        system.forces(values + s * way) for s in (e, -e)
    )
    gradient, tangent = system.forces(values)[1], system.tangent(values)
    assert (over - under) / (2 * e) == pytest.approx(gradient @ way, rel=1e-5)
    change = tangent @ way
    difference = (gradient_over - gradient_under) / (2 * e)
    assert np.abs(difference - change).max() < 1e-5 * np.abs(change).max()
    assert abs(tangent - tangent.T).max() < 1e-12 * abs(tangent).max()


@pytest.mark.parametrize("kind", ["pulled", "pressed", "uneven"])
def test_a_small_touch_on_the_shell_is_linear(kind):
    plate, touches = KINDS[kind], [fe.Touch(33.0, 41.0, 1e-4)]
    at = np.array([[50.0, 30.0], [20.0, 55.0], [84.0, 60.0]])
    linear, shell = fe.deflect(plate, touches, MESH), fe.solve(plate, touches, mesh=MESH)
    for found, truth in (
        (shell.displacement(at), linear.displacement(at)),
        (shell.strain(at), linear.strain(at)),
    ):
        assert np.abs(found - truth).max() < 2e-4 * np.abs(truth).max()


def arch(plate, rise, touch, x):
    """Mean deflection across a strip on hinges under 1 N, a parabola of some rise at rest, small.

    D w'''' - N0 w'' - N w0'' = -P δ(x - c) with N = (E h / a) ∫ w0' w' dx and w0'' = -8 rise / a².
    Deflections are sums of sines; without Poisson's ratio means across the strip are exact.
    """
    a, b = plate.size
    wave = np.arange(1, 4001) * np.pi / a
    stiff = plate.rigidity * wave**4 + plate.tension[0] * wave**2
    # Of even load 1, and of 1 / b at the touch.
    even = 2 * (1 - np.cos(wave * a)) / (wave * a) / stiff
    point = 2 * np.sin(wave * touch) / (a * b) / stiff
    area = (1 - np.cos(wave * a)) / wave
    bend, pull = -8 * rise / a**2, plate.young * plate.thickness / a
    # ∫ w0' w' = -w0'' ∫ w, and w = -point + N w0'' even.
    force = pull * bend * (point @ area) / (1 + pull * bend**2 * (even @ area))
    return np.sin(np.outer(x, wave)) @ (-point + force * bend * even), force


@pytest.mark.parametrize("tension", [0.0, 1.5, -0.3])
@pytest.mark.parametrize("rise", [0.8, -0.5])
def test_a_small_touch_on_an_arch(tension, rise):
    strip = fe.Plate((90.0, 24.0), 1.0, 3000.0, 0.0, fe.Edges(S, S, F, F), (), (tension, 0.0, 0.0))
    # rise (1 - ξ²)
    parabola = fe.Shape(0.0, ((2 / 3 * rise,), (0.0,), (-2 / 3 * rise,)))
    strip, force = dataclasses.replace(strip, shape=parabola), 1e-4
    mesh, x = fe.Mesh(strip.size, (36, 10)), np.array([15.0, 30.0, 60.0])
    truth, pulled = arch(strip, rise, 30.0, x)
    flat, _ = arch(strip, 0.0, 30.0, x)
    assert np.abs(truth / flat - 1).max() > 0.2
    places, weights = np.polynomial.legendre.leggauss(6)
    across = 12.0 * (1 + places)
    at = np.stack(np.meshgrid(x, across, indexing="ij"), axis=-1).reshape(-1, 2)
    touches = [fe.Touch(30.0, 9.0, force)]
    karman = Karman(strip, mesh).solve(pressure(Karman(strip, mesh), tuple(touches)))
    shell = fe.solve(strip, touches, mesh=mesh)
    for w in (derivative(mesh, at).of(karman.values)[:, 0], shell.deflection(at)):
        mean = w.reshape(3, -1) @ weights / 2 / force
        assert mean == pytest.approx(truth, rel=2e-3)
    stress = karman.plane.stress[0, ..., 0].mean() / force
    assert stress == pytest.approx(pulled, rel=5e-3)


def test_the_shell_and_karman_agree_far_beyond_linear_theory(plate):
    touches = (fe.Touch(33.0, 41.0, 9.0, 6.0), fe.Touch(66.0, 20.0, 5.0, 6.0))
    loads = np.zeros((*MESH.shape, 1))
    shell = fe.solve(plate, touches, mesh=MESH)
    loads[:, :, 0] = shell.loads[:, :, 2]
    karman = Karman(plate, MESH).solve(loads)
    assert shell.stability.verdict is fe.Verdict.STABLE
    assert karman.residual < 1e-9
    x, y = (0.5 * (nodes[1:] + nodes[:-1]) for nodes in MESH.nodes)
    at = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    read, moved = derivative(MESH, at), shell.displacement(at, "middle")
    w = read.of(karman.values)[:, 0]
    u = np.column_stack([read.of(np.ascontiguousarray(p))[:, 0] for p in karman.plane.values])
    assert np.abs(w).max() > 0.3 * plate.thickness
    assert np.abs(w - moved[:, 2]).max() < 3e-3 * np.abs(w).max()
    assert np.abs(u - moved[:, :2]).max() < 3e-2 * np.abs(u).max()


def test_influence_on_a_bowed_plate_is_a_small_difference():
    base = fe.solve(KINDS["all"], [fe.Touch(40.0, 30.0, 3.0)], mesh=MESH)
    gauges, place, small = np.array([[60.0, 45.0], [21.0, 18.0]]), (53.0, 37.0), 1e-3
    both = (replace(state, touches=()) for state in (base.touch([fe.Touch(*place, small)]), base))
    after, before = (state.strain(gauges) for state in both)
    change = after - before
    influence = fe.shell_influence(base, gauges)
    truth = change / small
    assert influence.strain([place])[0] == pytest.approx(truth, abs=1e-3 * np.abs(truth).max())


def test_a_base_takes_a_flat_plate():
    strip = changed(edges=fe.Edges(C, C, F, F), shape=fe.Shape(0.1))
    with pytest.raises(
        ValueError, match=r"^base bends and twists a flat plate, got one with Shape"
    ):
        fe.solve(strip, [], fe.Base(bend=1.0))


def test_the_shell_refuses_a_plate_that_has_buckled():
    plate = changed(tension=(-40.0, -40.0, 0.0))
    with pytest.raises(ValueError, match=r"^plate tension must press less than buckling does, got"):
        fe.solve(plate, [fe.Touch(40.0, 30.0, 1.0)], mesh=MESH)

"""Touches that bend a plate far: limits, symmetry, stability, and influence at a state."""

from dataclasses import replace

import numpy as np
import pytest

import fe
from fe.linear.load import spread
from fe.shell import Base, Shell, Verdict, shell_mesh, solve
from rig.studies.plates.aspect import strip

PVC = fe.Plate((254.0, 200.0), 1.0, 3000.0, 0.38)
MESH = fe.grid(PVC, 20)
XY = np.random.default_rng(1).uniform(0, 1, (40, 2)) * PVC.size
TWO = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())
MIXED = fe.Edges(fe.Clamped(), fe.Supported(), fe.Elastic(2.0, 50.0, 3.0), fe.Free())


@pytest.mark.parametrize("edges", [fe.Clamped(), fe.Supported(), TWO, MIXED])
def test_a_tiny_touch_bends_as_in_linear_theory(edges):
    plate = fe.Plate(PVC.size, PVC.thickness, PVC.young, PVC.poisson, edges)
    touches = [fe.Touch(100.0, 90.0, 1e-6)]
    state, linear = solve(plate, touches, mesh=MESH), fe.deflect(plate, touches, MESH)
    at = XY[~state.near_touch(XY)]
    for quantity in ("deflection", "displacement", "strain"):
        large, small = getattr(state, quantity)(at), getattr(linear, quantity)(at)
        assert np.abs(large - small).max() < 2e-6 * np.abs(small).max(), quantity


def test_patches_and_discs_bend_as_in_linear_theory():
    patch = fe.Patch((60.0, 130.0), (40.0, 90.0), 2.5, 200.0)
    plate = fe.Plate(PVC.size, 1.0, 3000.0, 0.38, patches=(patch,))
    mesh, touches = fe.grid(plate, 24), [fe.Touch(100.0, 90.0, 1e-6, radius=8.0)]
    state, linear = solve(plate, touches, mesh=mesh), fe.deflect(plate, touches, mesh)
    at = XY[~state.near_touch(XY)]
    large, small = state.strain(at), linear.strain(at)
    assert np.abs(large - small).max() < 1e-6 * np.abs(small).max()


def test_a_touch_stretches_the_plate_and_so_meets_more_resistance():
    shell = Shell(PVC, MESH)
    one, five = (shell.undeformed.touch([fe.Touch(100.0, 90.0, f)]) for f in (1e-3, 5.0))
    at = [[100.0, 90.0]]
    assert five.deflection(at)[0] < 0
    assert five.deflection(at)[0] > 0.5 * 5000 * one.deflection(at)[0]
    assert five.stability.verdict is Verdict.STABLE
    assert five.stability.iterations <= 8
    assert five.stability.residual < 1e-12
    assert five.stability.eigenvalue > 2.0
    assert one.stability.eigenvalue == pytest.approx(1.0, abs=1e-4)


def test_two_touches_press_one_after_the_other_or_together_alike():
    first, second = fe.Touch(100.0, 90.0, 1.0), fe.Touch(180.0, 50.0, 0.7)
    shell = Shell(PVC, MESH)
    together = shell.undeformed.touch([first, second])
    alone = shell.undeformed.touch([first])
    straight = alone.load(together.loads - alone.loads)
    np.testing.assert_allclose(straight.values, together.values, atol=1e-9)


def test_a_touch_in_the_middle_bends_the_plate_evenly():
    state = solve(PVC, [fe.Touch(127.0, 100.0, 3.0)], mesh=MESH)
    mirrored = np.array(PVC.size) * [1, 0] + XY * [-1, 1]
    turned = np.array(PVC.size) - XY
    np.testing.assert_allclose(
        state.displacement(mirrored) * [-1, 1, 1], state.displacement(XY), atol=1e-9
    )
    np.testing.assert_allclose(state.strain(turned), state.strain(XY), atol=1e-12)


def test_strain_converges():
    plate, touches = PVC, [fe.Touch(100.0, 90.0, 3.0)]
    ring = np.array([[20.0, 30.0], [20.0, 120.0], [200.0, 180.0], [127.0, 20.0]])
    coarse, middle, fine = (
        solve(plate, touches, mesh=fe.grid(plate, n)).strain(ring) for n in (12, 24, 36)
    )
    scale = np.abs(fine).max()
    assert np.abs(middle - fine).max() < 2e-3 * scale
    assert np.abs(middle - fine).max() < 0.3 * np.abs(coarse - fine).max()


def test_influence_at_a_state_is_the_change_by_a_small_further_touch():
    state = solve(PVC, [fe.Touch(90.0, 80.0, 2.0)], mesh=fe.grid(PVC, 16))
    gauges, at, force = XY[:6], np.array([[150.0, 60.0], [60.0, 150.0]]), 1e-3
    influence = fe.shell_influence(state, gauges)
    for k, (x, y) in enumerate(at):
        pressed = (state.touch([fe.Touch(x, y, s * force)]) for s in (1, -1))
        more, less = (replace(bent, touches=()).strain(gauges) for bent in pressed)
        truth = (more - less) / (2 * force)
        assert np.abs(influence.strain(at)[k] - truth).max() < 1e-6 * np.abs(truth).max()


def test_influence_of_the_flat_plate_is_that_of_linear_theory():
    flat = fe.shell_influence(Shell(PVC, MESH).undeformed, XY[:5], face="bottom")
    linear = fe.influence(PVC, XY[:5], MESH, face="bottom")
    scale = np.abs(linear.strain(XY)).max()
    np.testing.assert_allclose(flat.strain(XY), linear.strain(XY), atol=1e-8 * scale)
    np.testing.assert_allclose(flat.gradient(XY), linear.gradient(XY), atol=1e-8 * scale)


def test_gradient_of_the_influence_is_exact():
    state = solve(PVC, [fe.Touch(90.0, 80.0, 2.0)], mesh=fe.grid(PVC, 12))
    influence, at, e = fe.shell_influence(state, XY[:4]), XY[5:15].clip(1, 199), 1e-4
    for axis, way in enumerate(e * np.eye(2)):
        truth = (influence.strain(at + way) - influence.strain(at - way)) / (2 * e)
        found = influence.gradient(at)[..., axis]
        assert np.abs(found - truth).max() < 1e-6 * np.abs(truth).max()


def test_work_of_a_touch_is_the_energy_it_leaves():
    # dW/dF = F dw/dF for the exact minimum, by differences over the force.
    shell, at = Shell(PVC, fe.grid(PVC, 12)), [[100.0, 90.0]]
    states = [shell.undeformed.touch([fe.Touch(100.0, 90.0, f)]) for f in (1.99, 2.0, 2.01)]
    energy = [shell.system.forces(s.values.ravel())[0] for s in states]
    w = [-s.deflection(at)[0] for s in states]
    assert energy[2] - energy[0] == pytest.approx(2.0 * (w[2] - w[0]), rel=1e-4)


def test_default_mesh_has_as_many_elements_as_a_square_of_forty():
    assert shell_mesh(PVC).counts == (46, 38)


def test_the_default_mesh_of_a_long_plate_is_fine_along_its_edges():
    mesh = shell_mesh(fe.Plate((1000.0, 100.0), 1.0, 3000.0, 0.3))
    for nodes in mesh.nodes:
        assert np.diff(nodes)[[0, -1]].max() < 2.0
    assert np.diff(mesh.nodes[0])[40] > 5.0


@pytest.mark.slow
def test_even_pressure_bends_a_plate_between_two_clamps_as_it_does_timoshenkos_strip():
    """Without Poisson's ratio free ends do not know that the strip goes on."""
    clamped, free = fe.Clamped(), fe.Free()
    plate = fe.Plate((140.0, 100.0), 0.2, 3000.0, 0.0, fe.Edges(free, free, clamped, clamped))
    pressure, depth, centre, edge = strip(plate)
    state = solve(plate, [], loads=[fe.Pressure(pressure)])
    places = [(70.0, 50.0), (70.0, 0.0)]
    # 0.9e-3 and 2e-5 measured; 1.4e-3 on equal elements.
    assert np.abs(state.strain(places)[:, 1] - [centre, edge]).max() < 1e-3 * edge
    assert -state.deflection(places[:1]) == pytest.approx(depth, rel=1e-4)


def test_plates_that_float_in_their_plane_are_refused():
    held = fe.Elastic(deflection=np.inf, rotation=0.0)
    plate = fe.Plate(PVC.size, 1.0, 3000.0, 0.38, held)
    with pytest.raises(ValueError, match=r"in its plane too.*membrane spring"):
        solve(plate, [fe.Touch(100.0, 90.0, 1.0)])


def test_a_disc_presses_as_its_points_do_and_less_deep_than_one_point():
    shell = Shell(PVC, MESH)
    disc = fe.Touch(100.0, 90.0, 3.0, radius=10.0)
    xy, along_z, _ = spread(PVC, MESH, [disc])
    points = [fe.Touch(x, y, -f) for (x, y), f in zip(xy, along_z, strict=True)]
    whole, parts = shell.undeformed.touch([disc]), shell.undeformed.touch(points)
    np.testing.assert_allclose(whole.values, parts.values, atol=1e-10)
    point = shell.undeformed.touch([fe.Touch(100.0, 90.0, 3.0)])
    assert point.deflection([[100.0, 90.0]])[0] < whole.deflection([[100.0, 90.0]])[0] < 0
    small = shell.undeformed.touch([fe.Touch(100.0, 90.0, 3.0, radius=1e-3)])
    np.testing.assert_allclose(small.values, point.values, atol=1e-6)


@pytest.mark.parametrize(
    ("touch", "sentence"),
    [
        (fe.Touch(300.0, 90.0, 1.0), "touch 0 must lie on the plate"),
        (fe.Touch(253.0, 90.0, 1.0, radius=2.0), "touch disc of radius 2 mm"),
    ],
)
def test_touches_outside_are_refused_before_the_base_is_bent(touch, sentence, monkeypatch):
    plate = fe.Plate(PVC.size, 1.0, 3000.0, 0.38, TWO)
    monkeypatch.setattr(Shell, "at", lambda *_: pytest.fail("the base was bent"))
    with pytest.raises(ValueError, match=sentence):
        solve(plate, [touch], Base(10.0, 30.0))


def test_states_are_read_only():
    with pytest.raises(ValueError, match="read-only"):
        Shell(PVC, MESH).undeformed.values[0, 0, 0] = 1.0

"""Bent and twisted bases, touches on them, and plates that snap."""

from functools import cache

import numpy as np
import pytest
from scipy.special import ellipe, ellipk

import fe
from fe.elements.functional import derivative
from fe.linear.load import spread
from fe.shell import Base, Shell, Verdict
from rig.studies.plates.elastica import elastica

TWO = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())
PAPER = fe.Plate((100.0, 100.0), 1.0, 3000.0, 0.3, TWO)
COARSE = Shell(PAPER, fe.grid(PAPER, 12))


@cache
def bent(bend, twist=0.0):
    return COARSE.at(Base(bend, twist))


@pytest.mark.parametrize("bend", [5.0, 20.0, 40.0])
def test_a_bent_strip_is_the_elastica(bend):
    thin = fe.Plate((100.0, 60.0), 0.2, 3000.0, 0.0, TWO)
    state = Shell(thin, fe.Mesh(thin.size, (24, 8))).at(Base(bend))
    middle = state.displacement([[50.0, 30.0]], face="middle")[0]
    assert middle[2] == pytest.approx(elastica(100.0, bend), rel=1e-3)
    np.testing.assert_allclose(middle[:2], 0.0, atol=1e-8)
    assert state.stability.verdict is Verdict.STABLE
    assert state.stability.iterations <= 8


def test_the_elastica_stands_upright_where_bends_are_refused():
    k = np.sqrt(0.5)
    limit = 100.0 * (2 - 2 * ellipe(k**2) / ellipk(k**2))
    assert COARSE.at(Base(0.9 * limit)).stability.converged
    with pytest.raises(ValueError, match=rf"must stay below {limit:.4g} mm.*got 54.4 mm"):
        COARSE.at(Base(54.4))


def test_clamps_move_rigidly_and_hold_the_normal():
    base = Base(8.0, 20.0)
    state = COARSE.at(base)
    y = np.linspace(0, 100, 5)
    for x, sense in ((0.0, -1), (100.0, 1)):
        angle = sense * np.radians(10.0)
        edge = np.column_stack([np.full(5, x), y])
        place = np.column_stack([edge, np.zeros(5)]) + state.displacement(edge, face="middle")
        truth = [
            np.full(5, x - sense * 4.0),
            50 + (y - 50) * np.cos(angle),
            (y - 50) * np.sin(angle),
        ]
        np.testing.assert_allclose(place, np.column_stack(truth), atol=1e-9)
        normal = np.tile([0.0, -np.sin(angle), np.cos(angle)], (5, 1))
        np.testing.assert_allclose(state.normal(edge), normal, atol=1e-9)


def test_clamps_turn_rigidly_between_the_nodes_too_whatever_the_shape_of_elements():
    plate = fe.Plate((100.0, 60.0), 1.0, 3000.0, 0.3, TWO)
    mesh, base = fe.Mesh(plate.size, (8, 14)), Base(3.0, 25.0)
    lift = Shell(plate, mesh).support(base).lift.reshape(*mesh.shape, 3)
    y = np.linspace(1.0, 59.0, 12)
    for x, motion in zip((0.0, 100.0), base.clamps(plate), strict=True):
        edge = np.column_stack([np.full(12, x), y])
        place = np.column_stack([edge, np.zeros(12)])
        truth = place @ motion.turn.T + motion.shift - place
        np.testing.assert_allclose(derivative(mesh, edge).of(lift), truth, atol=1e-12)
        across = derivative(mesh, edge, 1, 0).of(lift)
        np.testing.assert_allclose(
            across, np.tile(motion.turn[:, 0] - [1, 0, 0], (12, 1)), atol=1e-12
        )


@pytest.mark.slow
@pytest.mark.parametrize(("bend", "twist"), [(10.0, 30.0), (20.0, 45.0)])
def test_large_bends_with_twists_converge_and_say_how_stable_they_are(bend, twist):
    stability = bent(bend, twist).stability
    assert stability.converged
    assert stability.residual < 1e-10
    assert 0 < stability.eigenvalue < 1


def test_the_plate_of_bend_10_and_twist_30_is_near_its_limit():
    assert bent(10.0, 30.0).stability.verdict is Verdict.NEAR_LIMIT  # eigenvalue 0.009


@pytest.mark.slow
def test_opposite_twists_are_mirror_images_in_energy():
    left, right = (bent(10.0, twist) for twist in (-15.0, 15.0))
    energies = [COARSE.system.forces(s.values.ravel())[0] for s in (left, right)]
    assert energies[0] == pytest.approx(energies[1], rel=1e-9)


def test_a_small_twist_of_a_flat_plate_stretches_it_without_buckling():
    state = COARSE.at(Base(0.0, 2.0))
    assert state.stability.verdict is Verdict.STABLE
    assert state.deflection([[50.0, 50.0]])[0] == pytest.approx(0.0, abs=1e-9)
    assert state.deflection([[100.0, 100.0]])[0] == pytest.approx(50 * np.sin(np.radians(1.0)))


def test_less_than_the_buckling_load_leaves_the_plate_flat():
    state = COARSE.at(Base(0.02))
    assert np.abs(state.deflection([[50.0, 50.0], [25.0, 50.0]])).max() < 1e-6
    assert 0 < state.stability.eigenvalue < 0.6


def test_a_touch_on_a_base_presses_against_its_normal():
    state = bent(10.0)
    touched = state.touch([fe.Touch(25.0, 50.0, 0.5)])
    normal = state.normal([[25.0, 50.0]])[0]
    assert abs(normal[0]) > 0.3
    force = touched.loads[0::2, 0::2].sum(axis=(0, 1))
    np.testing.assert_allclose(force, -0.5 * normal, atol=1e-12)
    assert touched.base == state.base
    assert touched.stability.converged


@pytest.mark.slow
def test_influence_on_a_base_is_the_change_by_a_small_touch():
    state = bent(10.0, 15.0)
    gauges, force = np.array([[5.0, 20.0], [50.0, 95.0], [95.0, 70.0]]), 1e-3
    more, less = (state.touch([fe.Touch(40.0, 30.0, s * force)]).strain(gauges) for s in (1, -1))
    truth = (more - less) / (2 * force)
    found = fe.shell_influence(state, gauges).strain([[40.0, 30.0]])[0]
    assert np.abs(found - truth).max() < 1e-5 * np.abs(truth).max()


def test_gradient_of_the_influence_on_a_base_is_exact():
    influence = fe.shell_influence(bent(10.0, 15.0), [[5.0, 20.0], [50.0, 95.0], [95.0, 70.0]])
    at, e = np.array([[40.0, 30.0], [71.0, 88.0], [12.0, 55.0]]), 1e-4
    for axis, way in enumerate(e * np.eye(2)):
        truth = (influence.strain(at + way) - influence.strain(at - way)) / (2 * e)
        found = influence.gradient(at)[..., axis]
        assert np.abs(found - truth).max() < 1e-6 * np.abs(truth).max()


def test_a_disc_on_a_base_presses_against_the_normal_at_each_of_its_points():
    state = bent(10.0, 15.0)
    xy, along_z, _ = spread(PAPER, COARSE.mesh, [fe.Touch(30.0, 60.0, 0.2, radius=8.0)])
    touched = state.touch([fe.Touch(30.0, 60.0, 0.2, radius=8.0)])
    force = touched.loads[0::2, 0::2].sum(axis=(0, 1))
    np.testing.assert_allclose(force, along_z @ state.normal(xy), atol=1e-12)
    assert touched.stability.converged
    # For a force so small the disc reads the mean of the influence of its points.
    influence = fe.shell_influence(state, [[5.0, 20.0], [50.0, 95.0]])
    weights, tiny = along_z / along_z.sum(), fe.Touch(30.0, 60.0, 1e-4, radius=8.0)
    change = state.touch([tiny]).strain(influence.gauges) - state.strain(influence.gauges)
    mean = 1e-4 * np.einsum("k,kmi->mi", weights, influence.strain(xy))
    assert np.abs(change - mean).max() < 1e-3 * np.abs(mean).max()


def test_an_arch_keeps_its_shape_up_to_its_limit():
    pressed = bent(2.0).touch([fe.Touch(50.0, 50.0, 32.0)])
    assert pressed.deflection([[50.0, 50.0]])[0] > 5.0
    assert pressed.stability.verdict is Verdict.STABLE
    assert pressed.stability.eigenvalue < 0.5 * bent(2.0).stability.eigenvalue


@pytest.mark.parametrize(("x", "force"), [(50.0, 60.0), (30.0, 64.0), (30.0, 128.0)])
def test_pressing_an_arch_hard_snaps_it_and_says_so(x, force):
    arch = bent(2.0)
    assert arch.deflection([[50.0, 50.0]])[0] > 5.0
    snapped = arch.touch([fe.Touch(x, 50.0, force)])
    assert snapped.deflection([[50.0, 50.0]])[0] < -5.0
    assert snapped.stability.converged
    assert snapped.stability.verdict is Verdict.OTHER_BRANCH


@pytest.mark.slow
def test_a_finer_mesh_takes_over_the_shape_of_a_coarse_one():
    fine, coarse = Shell(PAPER, fe.grid(PAPER, 22)).at(Base(10.0, 5.0)), bent(10.0, 5.0)
    xy = np.random.default_rng(2).uniform(0, 100, (30, 2))
    difference = fine.displacement(xy) - coarse.displacement(xy)
    assert np.abs(difference).max() < 5e-3 * np.abs(coarse.displacement(xy)).max()


def test_bases_that_no_plate_takes_are_refused_in_a_sentence():
    with pytest.raises(ValueError, match="bend of the base must be 0 mm or more, got -1 mm"):
        Base(-1.0)
    with pytest.raises(ValueError, match="twist of the base must lie between -90 and 90 degrees"):
        Base(0.0, 90.0)
    clamped = fe.Plate((100.0, 80.0), 1.0, 3000.0, 0.3)
    with pytest.raises(ValueError, match="south edge must be free or on springs"):
        Shell(clamped, fe.grid(clamped, 12)).at(Base(5.0))
    edges = fe.Edges(fe.Supported(), fe.Clamped(), fe.Free(), fe.Free())
    hinged = fe.Plate((100.0, 80.0), 1.0, 3000.0, 0.3, edges)
    with pytest.raises(ValueError, match=r"west edge must be clamped.*got supported"):
        Shell(hinged, fe.grid(hinged, 12)).at(Base(5.0))

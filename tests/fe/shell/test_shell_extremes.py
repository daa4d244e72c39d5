"""Plates at the ends of their ranges: thin to a membrane, soft, stiff, wrinkled."""

from math import inf, isnan

import numpy as np
import pytest

import fe
from fe.shell import Verdict, solve
from rig.studies.plates.rod import STRIP_SIZE, pressed_shell, strip

SIZE, YOUNG = (254.0, 200.0), 3000.0
TWO = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())


def pull(thickness):
    """Force that stretches thin plates to one strain, or bends the thick ones, N."""
    return 1e-3 * YOUNG * thickness**2 + 1e-6 * YOUNG * thickness * SIZE[1]


@pytest.mark.parametrize("thinness", [4e-2, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7])
def test_plates_of_any_thickness_find_their_equilibrium_from_rest(thinness):
    plate = fe.Plate(SIZE, thinness * SIZE[1], YOUNG, 0.38)
    touch = fe.Touch(100.0, 90.0, pull(plate.thickness))
    stability = solve(plate, [touch], mesh=fe.grid(plate, 16)).stability
    assert stability.verdict is Verdict.STABLE
    assert stability.iterations <= 10  # measured 3, 5, 7, 7, 8, 9, 10
    assert stability.residual < 1e-12


@pytest.mark.parametrize("thinness", [1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
def test_a_strip_under_pressure_goes_from_plate_to_membrane(thinness):
    thickness = thinness * STRIP_SIZE[0]
    pressure, truth = strip(thickness)
    state = pressed_shell(thickness, pressure)
    assert state.stability.verdict is Verdict.STABLE
    middle = state.deflection([[50.0, 5.0]])[0]
    assert middle == pytest.approx(truth, rel=1e-5)  # measured 5e-6 at 1e-2, then 1e-6 and less


@pytest.mark.parametrize("contrast", [1e-12, 1e-6, 1e-3, 1e3, 1e6, 1e9, 1e10])
def test_soft_and_stiff_patches_converge(contrast):
    patch = fe.Patch((60.0, 130.0), (40.0, 90.0), 1.0, YOUNG * contrast)
    plate = fe.Plate(SIZE, 1.0, YOUNG, 0.38, patches=(patch,))
    stability = solve(plate, [fe.Touch(200.0, 90.0, 2.0)], mesh=fe.grid(plate, 12)).stability
    assert stability.verdict is Verdict.STABLE
    assert stability.iterations <= 8
    # Rounding of displacements: measured 2e-16 of the contrast, without it 1e-19.
    assert stability.residual < 1e-6


def with_patch(contrast):
    patch = fe.Patch((60.0, 130.0), (40.0, 90.0), 1.0, YOUNG * contrast)
    plate = fe.Plate(SIZE, 1.0, YOUNG, 0.38, patches=(patch,))
    return solve(plate, [fe.Touch(200.0, 90.0, 2.0)], mesh=fe.grid(plate, 12))


def test_a_stiff_patch_moves_as_a_rigid_one():
    places = [[200.0, 90.0], [100.0, 60.0]]
    softest, *stiffer = (with_patch(contrast).deflection(places) for contrast in (1e7, 1e9, 1e12))
    for deflections in stiffer:  # what is left goes with 1 / contrast: measured 9e-8 at 1e7
        np.testing.assert_allclose(deflections, softest, rtol=1e-6)
    np.testing.assert_allclose(stiffer[1], stiffer[0], rtol=1e-8)


def test_a_stability_beyond_the_digits_is_not_known():
    state = with_patch(1e12)
    assert state.stability.residual < 1e-6
    assert state.stability.converged
    assert state.stability.verdict is Verdict.UNRESOLVED
    assert isnan(state.stability.eigenvalue)
    with pytest.raises(ValueError, match=r"influence needs a stable equilibrium.*eigenvalue nan"):
        fe.shell_influence(state, [[20.0, 30.0]])


@pytest.mark.slow
def test_a_contrast_beyond_the_digits_is_no_equilibrium():
    state = with_patch(1e13)
    assert state.stability.verdict is Verdict.NOT_CONVERGED
    assert state.stability.residual > 1e-6
    assert isnan(state.stability.eigenvalue)
    with pytest.raises(ValueError, match=r"influence needs a stable equilibrium.*residual"):
        fe.shell_influence(state, [[20.0, 30.0]])


@pytest.mark.parametrize("spring", [1e-6, 1e-3, 1.0, 1e6, 1e15])
def test_springs_from_soft_to_rigid_converge(spring):
    plate = fe.Plate(SIZE, 1.0, YOUNG, 0.38, fe.Elastic(spring, spring, spring))
    touch = fe.Touch(100.0, 90.0, 2.0)
    state = solve(plate, [touch], mesh=fe.grid(plate, 12))
    assert state.stability.verdict is Verdict.STABLE
    if spring == 1e15:
        rigid = fe.Plate(SIZE, 1.0, YOUNG, 0.38, fe.Elastic(inf, inf, inf))
        held = solve(rigid, [touch], mesh=fe.grid(plate, 12))
        np.testing.assert_allclose(state.values, held.values, atol=1e-9)


@pytest.mark.slow
def test_a_film_with_free_edges_wrinkles_finer_than_the_mesh_and_says_so():
    film = fe.Plate(SIZE, 1e-5 * SIZE[1], YOUNG, 0.38, TWO)
    state = solve(film, [fe.Touch(100.0, 90.0, pull(film.thickness))], mesh=fe.grid(film, 12))
    assert state.stability.verdict is Verdict.NOT_CONVERGED
    assert state.stability.residual > 1e-6


@pytest.mark.parametrize("place", [(1.0, 90.0), (1.0, 1.0), (253.9, 199.9)])
@pytest.mark.parametrize("force", [1e-12, 50.0, -50.0])
def test_touches_near_an_edge_or_a_corner_converge(place, force):
    plate = fe.Plate(SIZE, 1.0, YOUNG, 0.499)
    stability = solve(
        plate, [fe.Touch(place[0], place[1], force)], mesh=fe.grid(plate, 12)
    ).stability
    assert stability.verdict is Verdict.STABLE
    assert stability.iterations <= 8

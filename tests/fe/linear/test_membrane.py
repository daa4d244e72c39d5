"""The plate in its own plane: Hooke's law, free and held edges, and springs against a bar."""

import dataclasses
from math import inf, log

import numpy as np
import pytest

import fe
from fe.elements.functional import derivative
from fe.linear.membrane import Membrane
from fe.reduced.large_state import middle_strain

E, NU, H = 3000.0, 0.38, 1.5
PLATE = fe.Plate((90.0, 60.0), H, E, NU)
STRAINS = np.array([[1e-3, -4e-4, 7e-4], [0.0, 2e-3, 0.0], [0.0, 0.0, 1e-3]])


def relaxed(plate, strain):
    """Stress (3, gx, gy) after an even strain was put in."""
    membrane = Membrane(plate, fe.Mesh(plate.size, (8, 6)))
    even = np.broadcast_to(
        np.reshape(strain, (3, 1, 1, 1)), (3, *membrane.stiffness.shape, 1)
    ).astype(float)
    return membrane.relax(even).stress[..., 0]


@pytest.mark.parametrize("strain", STRAINS)
def test_held_edges_keep_the_stress_of_an_even_strain(strain):
    exx, eyy, exy = strain
    truth = [exx + NU * eyy, eyy + NU * exx, (1 - NU) * exy]
    for value, expected in zip(relaxed(PLATE, strain), truth, strict=True):
        assert value == pytest.approx(E * H / (1 - NU**2) * expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("strain", STRAINS)
def test_edges_free_in_the_plane_let_an_even_strain_go(strain):
    plate = dataclasses.replace(PLATE, edges=fe.Elastic(deflection=inf, rotation=0.0))
    assert np.abs(relaxed(plate, strain)).max() < 1e-8 * E * H * np.abs(strain).max()


@pytest.mark.parametrize("axis", [0, 1])
def test_springs_hold_a_bar_as_springs_in_a_row(axis):
    # Two springs k and the bar E h / a in a row share the strain e: N = E h e / (1 + 2 E h / k a).
    spring, free = fe.Elastic(inf, 0.0, membrane=40.0), fe.Elastic(inf, 0.0)
    edges = (spring, spring, free, free) if axis == 0 else (free, free, spring, spring)
    plate = dataclasses.replace(PLATE, poisson=0.0, edges=fe.Edges(*edges))
    stress = relaxed(plate, 1e-3 * np.eye(3)[axis])
    side = plate.size[axis]
    truth = np.zeros(3)
    truth[axis] = E * H * 1e-3 / (1 + 2 * E * H / (40.0 * side))
    for value, expected in zip(stress, truth, strict=True):
        assert value == pytest.approx(expected, rel=1e-8, abs=1e-8)


def test_a_slope_stretches_by_half_its_square():
    membrane = Membrane(PLATE, fe.Mesh(PLATE.size, (8, 6)))
    (ux, uy), values = membrane.mesh.units, np.zeros((*membrane.mesh.shape, 1))
    x, y = membrane.mesh.nodes
    values[0::2, 0::2, 0] = 0.03 * x[:, None] - 0.02 * y
    values[1::2, 0::2], values[0::2, 1::2] = 0.03 * ux, -0.02 * uy
    truth = [0.5 * 0.03**2, 0.5 * 0.02**2, -0.5 * 0.03 * 0.02]
    for value, expected in zip(membrane.stretching(values), truth, strict=True):
        assert value == pytest.approx(expected, rel=1e-9)


def test_strain_of_the_middle_follows_from_its_stress_by_hookes_law():
    mesh, xy = fe.Mesh(PLATE.size, (8, 6)), np.array([[12.3, 45.6], [90.0, 0.0]])
    stress = np.broadcast_to(np.array([5.0, -2.0, 3.0])[:, None], (9, 7, 3, 1))
    exx, eyy, exy = (5.0 + NU * 2.0, -2.0 - NU * 5.0, (1 + NU) * 3.0)
    truth = np.array([exx, eyy, exy]) / (E * H)
    found = middle_strain(PLATE, mesh, stress, xy)[:, :, 0]
    np.testing.assert_allclose(found, [truth, truth], rtol=1e-9)


@pytest.mark.parametrize("taper", [0.5, -0.8])
def test_a_stiff_plate_on_uneven_springs_moves_as_a_body(taper):
    """Pulled along x by 1 N at a height y it moves by α + β y, held along the west edge."""
    k, (a, b), y = 20.0, PLATE.size, 42.0
    west = fe.Elastic(inf, inf, membrane=k, taper=(0.0, 0.0, taper))
    edges = fe.Edges(west, fe.Free(), fe.Free(), fe.Free())
    stone = dataclasses.replace(PLATE, young=1e9, edges=edges)
    membrane = Membrane(stone, fe.Mesh(PLATE.size, (8, 6)))
    loads = np.zeros((2, *membrane.mesh.shape, 1))
    at, one = np.array([[a, y]]), np.ones(1)
    derivative(membrane.mesh, at).add_to(loads[0], one, np.zeros(1, dtype=int))
    moved = derivative(membrane.mesh, at).of(membrane.solve(loads)[0])[0, 0]
    # ∫ k yⁿ / (1 + taper s) dy with y = b (1 + s) / 2, from those of sⁿ.
    zero = log((1 + taper) / (1 - taper)) / taper
    first = (2 - zero) / taper
    second = -first / taper
    moments = [zero, zero + first, zero + 2 * first + second]
    held = [k * b / 2 * (b / 2) ** n * moment for n, moment in enumerate(moments)]
    alpha, beta = np.linalg.solve([held[:2], held[1:]], [1.0, y])
    assert moved == pytest.approx(alpha + beta * y, rel=1e-4)


@pytest.mark.parametrize("spring", [1e-12, 1e-14])
def test_a_plane_that_hardly_anything_holds_is_refused(spring):
    plate = fe.Plate(PLATE.size, H, E, NU, fe.Elastic(inf, inf, spring))
    with pytest.raises(ValueError, match=r"^stiffness of the plate has condition number"):
        _ = Membrane(plate, fe.grid(plate, 20)).factor

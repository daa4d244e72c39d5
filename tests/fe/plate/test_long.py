"""Plates much longer than wide: each door either computes them or refuses them at once."""

import numpy as np
import pytest

import fe

ACROSS = 50.0
FIRST = 4.730041  # root of cos x cosh x = 1: a strip clamped along both sides


def long_plate(aspect, **other):
    return fe.Plate((ACROSS * aspect, ACROSS), 1.0, 3000.0, 0.3, **other)


STRIP = long_plate(1000.0)
MANY = np.random.default_rng(2).uniform((500.0, 5.0), (49500.0, 45.0), (90, 2))
ENDS_HELD = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())

DOORS = {
    "default_mesh": lambda: fe.default_mesh(STRIP),
    "displacement_influence": lambda: fe.displacement_influence(STRIP, [(900.0, 20.0)]),
    "modes": lambda: fe.modes(STRIP, 12),
    "modal_plate": lambda: fe.modal_plate(STRIP),
    "reduced_plate": lambda: fe.reduced_plate(STRIP),
    "shell_mesh": lambda: fe.shell_mesh(STRIP),
    "solve under pressure": lambda: fe.solve(STRIP, [], loads=[fe.Pressure(1e-3)]),
    "base_shapes": lambda: fe.base_shapes(long_plate(1000.0, edges=ENDS_HELD), fe.Base(bend=20.0)),
    "buckling_factor": lambda: fe.buckling_factor(long_plate(1000.0, tension=(-1e-3, 0.0, 0.0))),
    "linear_range": lambda: fe.linear_range(long_plate(2000.0), 1.0),
    "deflect": lambda: fe.deflect(long_plate(2000.0), [fe.Touch(900.0, 20.0, 1.0)]),
    "influence": lambda: fe.influence(long_plate(2000.0), [(900.0, 20.0)]),
    "solve": lambda: fe.solve(long_plate(2000.0), [fe.Touch(900.0, 20.0, 1.0)]),
}


@pytest.mark.parametrize("door", DOORS)
def test_a_strip_that_would_fill_the_memory_is_refused_at_once(door):
    with pytest.raises(ValueError, match=r"^plate must be at most \d+ times as long as wide, got"):
        DOORS[door]()


@pytest.mark.parametrize(
    "door",
    [
        lambda: fe.deflect(STRIP, [fe.Touch(x, y, 1.0) for x, y in MANY]),
        lambda: fe.influence(STRIP, MANY),
        lambda: fe.solve(STRIP, [fe.Touch(x, y, 1.0) for x, y in MANY]),
    ],
)
def test_more_places_along_a_strip_than_a_mesh_can_resolve_are_refused(door):
    with pytest.raises(ValueError, match=r"takes \d+ elements, more than 100000; ask for fewer"):
        door()


def test_one_touch_on_a_strip_of_any_length_takes_the_elements_of_a_shorter_one():
    touch = fe.Touch(900.0, 20.0, 1.0)
    meshes = (fe.touch_mesh(long_plate(aspect), [touch]) for aspect in (100.0, 1000.0))
    shorter, longer = (mesh.counts[0] * mesh.counts[1] for mesh in meshes)
    assert longer < 1.5 * shorter


@pytest.mark.parametrize("edges", [fe.Clamped(), fe.Elastic(np.inf, np.inf, np.inf)])
def test_a_clamped_strip_sounds_as_a_clamped_beam_by_either_method(edges):
    # Springs go by Lanczos's method, clamps by products of beam modes.
    plate = long_plate(80.0, edges=edges)
    found = fe.modes(plate, 3, fe.Mesh(plate.size, (200, 6))).stiffness
    beam = plate.rigidity * (FIRST / ACROSS) ** 4
    assert np.all(np.diff(found) > 0)
    assert found[0] == pytest.approx(beam, rel=1e-3)


def test_many_modes_of_a_strip_are_the_same_by_either_method():
    plate, springs = long_plate(20.0), fe.Elastic(np.inf, np.inf, np.inf)
    mesh = fe.Mesh(plate.size, (120, 6))
    by_products = fe.modes(plate, 40, mesh).stiffness
    by_lanczos = fe.modes(long_plate(20.0, edges=springs), 40, mesh).stiffness
    np.testing.assert_allclose(by_products, by_lanczos, rtol=5e-4)


def test_the_shell_of_a_strip_knows_its_lowest_frequency():
    plate = long_plate(60.0)
    shell = fe.Shell(plate, fe.Mesh(plate.size, (60, 6)))
    beam = plate.rigidity * (FIRST / ACROSS) ** 4
    assert shell.reference_eigenvalue == pytest.approx(beam, rel=2e-3)

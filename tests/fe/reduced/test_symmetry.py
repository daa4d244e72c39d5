"""States of a plate that lies on itself are laid on it; tension and progress beside them."""

import numpy as np
import pytest

import fe
from fe.reduced.basis import basis, fixed_shapes, work_on_strain
from fe.reduced.karman import Karman
from fe.reduced.parallel import PARTS, in_parallel
from fe.reduced.symmetry import symmetries
from fe.reduced.touch_shape import touch_shapes
from fe.reduced.training import pressure, sample, snapshot_steps, snapshots, split

C, S, F = fe.Clamped(), fe.Supported(), fe.Free()
SQUARE, OBLONG = (60.0, 60.0), (60.0, 40.0)
TAPERED = fe.Elastic(5.0, 100.0, 5.0, taper=0.3)


def plate(size, edges=C, **more):
    return fe.Plate(size, 1.0, 3000.0, 0.38, edges, **more)


@pytest.mark.parametrize(
    ("made", "count"),
    [
        (plate(SQUARE), 8),
        (plate(OBLONG), 4),
        (plate(SQUARE, fe.Edges(C, C, F, F)), 4),
        (plate(SQUARE, fe.Edges(C, F, C, F)), 2),
        (plate(OBLONG, fe.Edges(C, S, F, F)), 2),
        (plate(OBLONG, fe.Edges(C, S, C, F)), 1),
        (plate(SQUARE, tension=(0.1, 0.2, 0.0)), 4),
        (plate(SQUARE, tension=(0.1, 0.1, 0.1)), 1),
        (plate(SQUARE, shape=fe.Shape(0.2)), 8),
        (plate(SQUARE, shape=fe.Shape(0.0, ((0.0, 0.0), (0.0, 0.1)))), 1),
        (plate(SQUARE, fe.Edges(TAPERED, C, C, C)), 1),
        (plate(SQUARE, patches=(fe.Patch((10.0, 20.0), (10.0, 20.0), 2.0, 3e3),)), 1),
    ],
)
def test_a_plate_lies_on_itself_in_as_many_ways_as_its_edges_allow(made, count):
    mesh = fe.grid(made, 12)
    assert len(symmetries(made, mesh)) == count


def test_a_mesh_that_is_not_even_has_fewer():
    assert len(symmetries(plate(SQUARE), fe.Mesh(SQUARE, (14, 12), ((20.0,), ())))) == 2


@pytest.mark.parametrize("edges", [C, fe.Edges(C, F, C, F), fe.Edges(C, C, F, F)])
def test_a_state_laid_on_the_plate_is_the_state_of_the_touch_laid_on_it(edges):
    made = plate(SQUARE, edges)
    karman = Karman(made, fe.Mesh(SQUARE, (10, 10)))
    touches = (fe.Touch(17.0, 41.0, 6.0), fe.Touch(33.0, 12.0, 4.0))
    state = karman.solve(pressure(karman, touches))
    for way in symmetries(made, karman.mesh):
        moved = tuple(way.touch(touch, SQUARE) for touch in touches)
        truth = karman.solve(pressure(karman, moved))
        for found, right in (
            (way.deflections(state.values), truth.values),
            (way.displacements(state.plane.values), truth.plane.values),
            (way.stresses(state.plane.stress), truth.plane.stress),
        ):
            assert np.abs(found - right).max() < 1e-6 * np.abs(right).max()


def test_tension_pulls_at_slopes():
    """Even tension T stores ½ T ∫ |∇w|² in a paraboloid that the elements hold exactly."""
    made = plate(OBLONG, fe.Edges(fe.Elastic(1.0, 1.0, 1.0), F, F, F))
    karman = Karman(made, fe.Mesh(OBLONG, (8, 7)))
    stress = np.zeros((3, *karman.membrane.stiffness.shape))
    stress[0], stress[1], stress[2] = 2.0, 3.0, 0.5
    x, y = np.meshgrid(*karman.mesh.nodes, indexing="ij")
    table = np.zeros(karman.mesh.shape)
    ux, uy = karman.mesh.units
    # w = x² + x y: slopes 2 x + y and x.
    table[0::2, 0::2], table[1::2, 0::2] = x**2 + x * y, ux * (2 * x + y)
    table[0::2, 1::2], table[1::2, 1::2] = uy * x, ux * uy
    a, b = OBLONG
    along = 4 * a**3 / 3 * b + 2 * (a**2 / 2) * b**2 + a * b**3 / 3
    across, mixed = a**3 / 3 * b, 2 * a**3 / 3 * b + a**2 / 2 * b**2 / 2
    free = table[karman.linear.free].ravel()
    work = free @ (karman.tension(stress) @ free)
    assert work == pytest.approx(2 * along + 3 * across + 2 * 0.5 * mixed)


def test_progress_goes_on_to_the_end_in_equal_words():
    said = []
    fe.reduced_plate(
        plate(SQUARE), fe.Mesh(SQUARE, (8, 8)), 3.0, lambda done, total: said.append((done, total))
    )
    done, totals = zip(*said, strict=True)
    assert list(done) == list(range(1, totals[0] + 1))
    assert len(set(totals)) == 1


def test_every_stretch_of_the_way_to_a_reduced_plate_says_a_word():
    """States, their parts, stresses and their work: none of them is one step."""
    made = Karman(plate(OBLONG), fe.Mesh(OBLONG, (10, 8)))
    touches, said = sample(made.plate, 2.0, 20), []

    def words(work):
        said.clear()
        found = work(lambda: said.append(None))
        return found, len(said)

    states, spoken = words(lambda say: snapshots(made, touches, say))
    assert spoken == snapshot_steps(touches) > len(touches)
    parts, spoken = words(lambda say: split(touch_shapes(made), states, say))
    assert spoken == PARTS
    ways = symmetries(made.plate, made.mesh)
    found, spoken = words(
        lambda say: basis(made, states, fixed_shapes(made, parts, ways), ways, say)
    )
    assert spoken == 1 + PARTS
    _, spoken = words(lambda say: work_on_strain(made, found.stresses, found.drifts, say))
    assert spoken == 2 * PARTS


def test_work_in_parallel_comes_in_order_and_an_error_stops_it():
    assert list(in_parallel(lambda k: k * k, range(9))) == [k * k for k in range(9)]
    with pytest.raises(ZeroDivisionError):
        list(in_parallel(lambda k: 1 // (k - 3), range(9)))

"""Patches of other thickness and modulus: strips that bend as stepped beams, contrasts, borders."""

import numpy as np
import pytest

import fe
from rig.studies.plates.stepped import EDGES, SIZE, STEP, cantilever, line_load, stepped


@pytest.mark.parametrize("thickness", [0.01, 0.5, 3.0, 10.0])
def test_a_stepped_strip_bends_as_a_stepped_cantilever(thickness):
    plate = stepped(thickness)
    state = fe.deflect(plate, line_load(120.0), fe.grid(plate, 40))
    for x in (30.0, 50.0, 80.0, 120.0):
        assert state.deflection([[x, 20.0]])[0] == pytest.approx(-cantilever(plate, x), rel=1e-5)
    for x, h in ((20.0, 1.0), (49.0, 1.0), (51.0, thickness), (100.0, thickness)):
        strain = 0.5 * h * (120.0 - x) / (3000.0 * 40.0 * h**3 / 12)
        found = state.strain([[x, 13.0]])[0]
        assert found[0] == pytest.approx(strain, rel=1e-5)
        # The load is spread by the trapezoid rule and not quite even.
        np.testing.assert_allclose(found[1:], 0.0, atol=1e-4 * strain)


def test_strain_jumps_at_a_border_and_belongs_to_the_side_of_larger_x():
    plate = stepped(2.0)
    state = fe.deflect(plate, line_load(120.0), fe.grid(plate, 40))
    before, at = state.strain([[STEP * (1 - 1e-12), 20.0], [STEP, 20.0]])[:, 0]
    assert before / at == pytest.approx(4.0, rel=1e-5)


@pytest.mark.parametrize("contrast", [1e-12, 1e-6, 1e4])
def test_digits_survive_a_contrast_of_modulus(contrast):
    plate = stepped(1.0, 3000.0 * contrast)
    state = fe.deflect(plate, line_load(120.0), fe.grid(plate, 40))
    for x in (30.0, 80.0, 120.0):
        assert state.deflection([[x, 20.0]])[0] == pytest.approx(-cantilever(plate, x), rel=1e-5)


def test_a_contrast_beyond_the_digits_is_refused():
    plate = stepped(1.0, 3e15)
    with pytest.raises(ValueError, match=r"^stiffness of the plate has condition number"):
        fe.deflect(plate, line_load(120.0), fe.grid(plate, 40))


@pytest.mark.slow
def test_a_patch_like_the_rest_changes_nothing():
    plain = fe.Plate((90.0, 60.0), 1.0, 3000.0, 0.38)
    patch = fe.Patch((20.0, 50.0), (10.0, 40.0), 1.0, 3000.0)
    same = fe.Plate((90.0, 60.0), 1.0, 3000.0, 0.38, patches=(patch,))
    touches = [fe.Touch(35.0, 25.0, 1.0), fe.Touch(70.0, 50.0, 2.0, radius=4.0)]
    xy = np.array([[5.0, 30.0], [85.0, 55.0], [60.0, 10.0]])
    one, other = fe.deflect(plain, touches), fe.deflect(same, touches, fe.grid(same, 100))
    np.testing.assert_allclose(one.deflection(xy), other.deflection(xy), rtol=1e-4)
    strain = one.strain(xy)
    np.testing.assert_allclose(strain, other.strain(xy), atol=2e-4 * np.abs(strain).max())


def test_influence_of_a_plate_with_patches_and_mixed_edges_survives_storage():
    edges = fe.Edges(fe.Clamped(), fe.Elastic(2.0, 30.0), fe.Free(), fe.Supported())
    patch = fe.Patch((20.0, 50.0), (10.0, 40.0), 2.0, 9000.0)
    plate = fe.Plate((90.0, 60.0), 1.0, 3000.0, 0.38, edges, (patch,))
    mesh = fe.grid(plate, 30)
    one = fe.influence(plate, [[30.0, 20.0], [80.0, 50.0]], mesh)
    other = fe.Influence.from_arrays(one.arrays())
    assert (other.plate, other.mesh) == (plate, mesh)
    xy = [[25.0, 30.0], [60.0, 20.0]]
    np.testing.assert_array_equal(one.strain(xy), other.strain(xy))
    direct = fe.deflect(plate, [fe.Touch(60.0, 20.0, 1.0)], mesh).strain(one.gauges)
    np.testing.assert_allclose(one.strain(xy)[1], direct, rtol=1e-6, atol=1e-12)


def test_a_mesh_without_breaks_at_the_borders_is_refused_even_where_it_has_lines():
    with pytest.raises(ValueError, match=r"^mesh must have a break at each border .* x = 50 mm"):
        fe.deflect(stepped(2.0), [], fe.Mesh(SIZE, (24, 10)))


def test_a_patch_lies_on_the_plate():
    patch = fe.Patch((100.0, 130.0), (0.0, 40.0), 1.0, 3000.0)
    with pytest.raises(ValueError, match=r"^patch must lie on the plate, x from 0 to 120 mm"):
        fe.Plate(SIZE, 1.0, 3000.0, 0.0, EDGES, (patch,))
    with pytest.raises(ValueError, match=r"^patch must run from a smaller to a larger y"):
        fe.Patch((0.0, 10.0), (40.0, 40.0), 1.0, 3000.0)
    with pytest.raises(ValueError, match=r"^patch thickness must be positive"):
        fe.Patch((0.0, 10.0), (0.0, 40.0), 0.0, 3000.0)

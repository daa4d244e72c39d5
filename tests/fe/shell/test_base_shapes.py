"""The shapes that a bent and twisted plate can rest in."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import fe
from fe.shell.shell import Shell

TWO = fe.Edges(fe.Clamped(), fe.Clamped(), fe.Free(), fe.Free())
PLATE = fe.Plate((100.0, 80.0), 1.0, 3000.0, 0.3, TWO)
MESH = fe.Mesh(PLATE.size, (10, 8))
XY = np.random.default_rng(1).uniform(0, PLATE.size, (30, 2))


@cache
def shapes(bend, twist):
    return fe.base_shapes(PLATE, fe.Base(bend, twist), MESH)


def test_a_bow_rests_up_or_down_with_the_energy_of_the_elastica():
    strip = fe.Plate((100.0, 60.0), 1.0, 3000.0, 0.0, TWO)
    found = fe.base_shapes(strip, fe.Base(6.0), fe.Mesh(strip.size, (16, 6)))
    assert [shape.name for shape in found] == ["up", "down"]
    k = float(brentq(lambda k: 2 - 2 * ellipe(k**2) / ellipk(k**2) - 0.06, 1e-6, 0.9))  # pyright: ignore[reportArgumentType]
    root = 4 * ellipk(k**2) / 100.0
    truth = 3000.0 * 60.0 * 1.0**3 / 12 * root**2 * (2 * k**2 * 100.0 - 6.0)
    for shape in found:
        assert shape.energy == pytest.approx(truth, rel=4e-3)  # of stretch too
        assert shape.state.stability.verdict is fe.Verdict.STABLE


@pytest.mark.slow
def test_a_bow_that_is_twisted_far_rests_in_four_shapes_of_equal_energy():
    found = shapes(1.0, 12.0)
    assert len({shape.name for shape in found}) == len(found) == 4
    energies = [shape.energy for shape in found]
    np.testing.assert_allclose(energies, energies[0], rtol=1e-8)
    w = [shape.state.deflection(XY) for shape in found]
    # Half a turn about x: what lies at y comes to lie at b - y, upside down.
    turned = -found[0].state.deflection(XY * [1, -1] + [0, 80.0])
    assert min(np.abs(turned - other).max() for other in w) < 1e-3
    assert all(np.abs(w[0] - other).max() > 1.0 for other in w[1:])
    assert all(shape.state.stability.verdict is fe.Verdict.STABLE for shape in found)


def test_one_of_the_shapes_is_the_one_that_the_shell_goes_over_to():
    at = Shell(PLATE, MESH).at(fe.Base(1.0, 12.0)).deflection(XY)
    off = [np.abs(at - shape.state.deflection(XY)).max() for shape in shapes(1.0, 12.0)]
    assert min(off) < 1e-3


def test_a_plate_that_is_twisted_alone_or_flat_has_one_shape():
    assert [shape.name for shape in shapes(0.0, 12.0)] == ["level"]
    (flat,) = shapes(0.0, 0.0)
    assert flat.energy == 0.0


def test_a_shape_is_followed_to_a_base_near_by():
    shape = shapes(1.0, 12.0)[-1].state
    there = shape.shell.moved(shape, fe.Base(1.1, 12.3))
    back = there.shell.moved(there, fe.Base(1.0, 12.0))
    assert there.stability.verdict is fe.Verdict.STABLE
    np.testing.assert_allclose(back.deflection(XY), shape.deflection(XY), atol=1e-6)
    assert np.abs(there.deflection(XY) - shape.deflection(XY)).max() > 0.1


def test_mirrored_shapes_twist_the_other_way():
    shape = shapes(1.0, 12.0)[0].state
    mirror = shape.shell.settled(fe.Base(1.0, -12.0), fe.mirrored(shape.values))
    assert mirror.energy == pytest.approx(shape.energy)
    np.testing.assert_allclose(mirror.values, fe.mirrored(shape.values), atol=1e-5)


def test_a_base_that_folds_is_refused_in_one_sentence():
    with pytest.raises(ValueError, match="begins to fold, got 60 mm") as refused:
        fe.base_shapes(PLATE, fe.Base(60.0))
    assert "\n" not in str(refused.value)

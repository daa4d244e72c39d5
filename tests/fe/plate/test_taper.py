"""A plate whose thickness rises along its sides: closed form, modes, shell and bench agree."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

import fe
from fe.reduced.symmetry import IDENTITY, symmetries

SIZE, THICKNESS, YOUNG = (120.0, 80.0), 1.5, 3000.0
TAPERED = fe.Plate(SIZE, THICKNESS, YOUNG, 0.38, taper=(0.2, -0.1))
PLACES = np.array([[30.0, 20.0], [60.0, 45.0], [95.0, 60.0]])


def test_the_thickness_is_a_plane_over_the_plate_and_patches_have_their_own():
    plate = fe.Plate(
        SIZE, 2.0, YOUNG, 0.38, patches=(fe.Patch((0, 30), (0, 20), 3.0, 10.0),), taper=(0.2, -0.1)
    )
    thickness, young = plate.material([[60.0, 40.0], [120.0, 80.0], [0.0, 80.0], [10.0, 10.0]])
    np.testing.assert_allclose(thickness, [2.0, 2.2, 1.4, 3.0])
    assert young.tolist() == [YOUNG, YOUNG, YOUNG, 10.0]


@pytest.mark.parametrize("taper", [(0.6, 0.4), (-1.0, 0.0), (np.nan, 0.0)])
def test_a_corner_without_thickness_is_refused(taper):
    with pytest.raises(ValueError, match="plate taper must leave a thickness at each corner"):
        fe.Plate(SIZE, 1.0, YOUNG, 0.38, taper=taper)


def beam(taper):
    """Deflection and curvature of a supported beam under pressure by statics, of x."""
    length, pressure = SIZE[0], 1e-4
    x = np.linspace(0.0, length, 20001)
    thickness = THICKNESS * (1.0 + taper * (2.0 * x / length - 1.0))
    moment = 0.5 * pressure * x * (length - x)
    bent = -moment / (YOUNG * thickness**3 / 12.0)
    deep = cumulative_trapezoid(cumulative_trapezoid(bent, x, initial=0), x, initial=0)
    deep -= deep[-1] * x / length
    at = PLACES[:, 0]
    strain = -0.5 * np.interp(at, x, thickness * bent)
    return pressure, -np.interp(at, x, deep), -strain


@pytest.mark.parametrize("taper", [0.25, -0.4])
def test_a_tapered_beam_bends_as_statics_say_and_twice_the_elements_err_by_a_quarter(taper):
    ends = fe.Edges(fe.Supported(), fe.Supported(), fe.Free(), fe.Free())
    plate = fe.Plate(SIZE, THICKNESS, YOUNG, 0.0, ends, taper=(taper, 0.0))
    pressure, deep, strain = beam(taper)
    errors = []
    for elements in (12, 24):
        load = fe.Pressure(pressure)
        state = fe.deflect(plate, [], fe.grid(plate, elements), loads=[load])
        errors.append(
            (
                np.abs(state.deflection(PLACES) / -np.abs(deep) - 1.0).max(),
                np.abs(np.abs(state.strain(PLACES)[:, 0] / strain) - 1.0).max(),
            )
        )
    (coarse, coarse_strain), (fine, fine_strain) = errors
    assert fine < 2e-3
    assert fine_strain < 1e-2
    assert fine < 0.3 * coarse
    assert fine_strain < 0.4 * coarse_strain


def test_modes_and_the_shell_bend_as_the_linear_plate():
    touch = fe.Touch(40.0, 30.0, 1e-4)
    mesh = fe.grid(TAPERED, 24)
    linear = fe.deflect(TAPERED, [touch], mesh).deflection(PLACES)
    shell = fe.solve(TAPERED, [touch], mesh=mesh).displacement(PLACES)[:, 2]
    np.testing.assert_allclose(shell, linear, rtol=1e-4)
    modes = fe.modes(TAPERED, 120, mesh)
    seen = modes.value(PLACES) @ modes.response(np.array([[touch.x, touch.y]]))[0]
    np.testing.assert_allclose(touch.force * seen, linear, rtol=1e-2)
    even = fe.deflect(fe.Plate(SIZE, THICKNESS, YOUNG, 0.38), [touch], mesh).deflection(PLACES)
    assert np.abs(linear / even - 1.0).max() > 0.1


@pytest.mark.slow
def test_a_bench_that_differs_by_a_taper_is_the_plate_that_has_it():
    mesh = fe.grid(fe.Plate(SIZE, THICKNESS, YOUNG, 0.38), 20)
    touch, small = np.array([[40.0, 30.0, 0.5]]), 0.01

    def deep(plate, **numbers):
        modal = fe.modal_plate(plate, 50, mesh)
        state = fe.BenchPlate(modal, fe.bench_values(**numbers)).press(touch)
        return modal.value(PLACES) @ state.values[: len(modal.stiffness)]

    plain = fe.Plate(SIZE, THICKNESS, YOUNG, 0.38)
    even, bench = deep(plain), deep(plain, thickness_x=small)
    tapered = deep(fe.Plate(SIZE, THICKNESS, YOUNG, 0.38, taper=(small, 0.0)))
    change = np.abs(tapered - even).max()
    assert change > 0.005 * np.abs(even).max()
    assert np.abs(bench - tapered).max() < 0.15 * change  # fifty modes of each are others


def test_a_tapered_plate_lies_on_itself_in_no_other_way():
    square = fe.Plate((80.0, 80.0), 1.0, YOUNG, 0.38)
    tapered = fe.Plate((80.0, 80.0), 1.0, YOUNG, 0.38, taper=(0.0, 0.1))
    assert len(symmetries(square, fe.grid(square, 8))) == 8
    assert symmetries(tapered, fe.grid(tapered, 8)) == [IDENTITY]


def test_a_stored_plate_keeps_its_taper():
    modes = fe.modes(TAPERED, 8, fe.grid(TAPERED, 12))
    arrays = modes.arrays()
    assert fe.Modes.from_arrays(arrays).plate == TAPERED
    older = {name: array for name, array in arrays.items() if name != "taper"}
    assert fe.Modes.from_arrays(older).plate.taper == (0.0, 0.0)

"""Plates of any aspect, and what a state says of its mesh, its touches and its material."""

import numpy as np
import pytest

import fe
from fe.linear.demand import equivalent
from rig.studies.plates.levy import levy

C, S = fe.Clamped(), fe.Supported()
PVC = {"thickness": 1.0, "young": 3000.0, "poisson": 0.38}
PLACES = np.array([(12.0, 0.0), (-10.0, 61.0), (31.0, 80.0), (6.0, 100.0), (-40.0, 25.0)])


def long_plate(aspect):
    """Plate of 100 mm across with supported ends."""
    return fe.Plate((100.0 * aspect, 100.0), 1.0, 3000.0, 0.3, fe.Edges(S, S, C, C))


@pytest.mark.parametrize("aspect", [1.5, pytest.param(20.0, marks=pytest.mark.slow)])
def test_strain_meets_the_series_at_any_aspect_and_its_stated_error_is_the_true_one(aspect):
    plate = long_plate(aspect)
    place = np.array([0.43 * plate.size[0], 37.0])
    state = fe.deflect(plate, [fe.Touch(*place, 1.0)])
    at = np.column_stack([place[0] + PLACES[:, 0], PLACES[:, 1]])
    series = [levy(plate, tuple(place), tuple(point), terms=round(600 * aspect)) for point in at]
    truth = 0.5 * np.array([curvature for _, curvature in series])
    off = np.abs(state.strain(at) - truth).max()
    assert off < 1e-5 * np.abs(truth).max()  # measured 3e-6
    stated = state.mesh_error(at)
    assert off / 3 < stated.strain.max() < 3 * off
    w = np.array([w for w, _ in series])
    assert np.abs(state.deflection(at) + w).max() < 1e-5 * np.abs(w).max()


@pytest.mark.slow
def test_the_error_of_an_influence_is_stated():
    plate = long_plate(12.0)
    gauges, place = np.array([[480.0, 5.0], [560.0, 95.0]]), (516.0, 37.0)
    influence = fe.influence(plate, gauges)
    series = [levy(plate, place, tuple(gauge), terms=7200)[1] for gauge in gauges]
    off = np.abs(influence.strain([place])[0] - 0.5 * np.array(series)).max()
    stated = influence.mesh_error([place]).max()
    assert stated / 4 < off < 4 * stated


def drawn_plates():
    """Plates with supported ends, held along their sides in three ways."""
    rng = np.random.default_rng(11)
    return [
        fe.Plate(
            (float(rng.uniform(90, 200)), float(rng.uniform(70, 120))),
            1.0,
            3000.0,
            0.3,
            fe.Edges(S, S, *sides),
        )
        for sides in ((C, C), (S, C), (S, fe.Free()))
    ]


def drawn_places(plate, count, seed):
    return np.random.default_rng(seed).uniform(0.15, 0.85, (count, 2)) * plate.size


def is_stated(off, stated):
    """Whether errors are stated within a factor of three, by their rms."""
    off, stated = (np.sqrt(np.mean(np.square(part))) for part in (off, stated))
    return off / 3 < stated < 3 * off


@pytest.mark.parametrize("plate", drawn_plates())
@pytest.mark.parametrize("face", ["top", "bottom"])
def test_the_error_of_a_displacement_influence_is_stated(plate, face):
    at, touched = drawn_places(plate, 3, 1), drawn_places(plate, 4, 2)
    influence = fe.displacement_influence(plate, at, fe.grid(plate, 36), face=face)
    found, stated = influence.displacement(touched), influence.mesh_error(touched)
    z, step = {"top": 0.5, "bottom": -0.5}[face], 1e-3

    def w(touch, place):
        return -levy(plate, tuple(touch), tuple(place), terms=8000)[0]

    steps = step * np.eye(2)
    off = np.empty(found.shape)
    for k, touch in enumerate(touched):
        for m, place in enumerate(at):
            slopes = [(w(touch, place + d) - w(touch, place - d)) / (2 * step) for d in steps]
            truth = [-z * slopes[0], -z * slopes[1], w(touch, place)]
            off[k, m] = found[k, m] - truth
    for component in (slice(0, 2), slice(2, 3)):
        assert is_stated(off[:, :, component], stated[:, :, component])
    again = fe.DisplacementInfluence.from_arrays(influence.arrays())
    np.testing.assert_array_equal(again.mesh_error(touched), stated)


@pytest.mark.parametrize("plate", drawn_plates())
def test_under_a_point_force_the_error_of_the_deflection_is_stated(plate):
    for place in drawn_places(plate, 4, 3):
        state = fe.deflect(plate, [fe.Touch(*place, 1.0)], fe.grid(plate, 30))
        off = state.deflection([place])[0] + levy(plate, tuple(place), tuple(place), 40000)[0]
        (stated,) = state.mesh_error([place]).deflection
        assert off / 3 < stated < 3 * off


def test_the_error_of_modes_is_that_against_the_supported_plate():
    for plate in drawn_plates():
        held = fe.Plate(plate.size, 1.0, 3000.0, 0.3, S)
        found = fe.modes(held, 20, fe.grid(held, 16))
        m, n = np.meshgrid(np.arange(1, 30), np.arange(1, 30))
        squares = (m / held.size[0]) ** 2 + (n / held.size[1]) ** 2
        truth = held.rigidity * np.pi**4 * np.sort(squares.ravel() ** 2)[:20]
        assert is_stated(found.stiffness - truth, found.mesh_error)


@pytest.mark.parametrize("plate", drawn_plates())
def test_the_error_of_modes_of_beam_products_is_that_of_the_sparse_problem_on_a_fine_mesh(plate):
    clamped, springs = (
        fe.Plate(plate.size, 1.0, 3000.0, 0.3, edges)
        for edges in (C, fe.Elastic(np.inf, np.inf, np.inf))
    )
    found = fe.modes(clamped, 40, fe.grid(clamped, 40))
    truth = fe.modes(springs, 40, fe.grid(springs, 80)).stiffness
    assert is_stated(found.stiffness - truth, found.mesh_error)


def test_modes_that_fewer_elements_do_not_carry_state_no_error():
    plate = fe.Plate((120.0, 90.0), **PVC)
    modes = fe.modes(plate, 24, fe.Mesh(plate.size, (12, 9)))
    with pytest.raises(ValueError, match=r"^a mesh of 8 by 6 elements carries at most"):
        _ = modes.mesh_error


@pytest.mark.slow
@pytest.mark.parametrize("plate", drawn_plates())
def test_the_error_of_the_influence_of_a_shell_is_that_against_the_series(plate):
    shell = fe.Shell(plate, fe.grid(plate, 24))
    gauges, touched = drawn_places(plate, 3, 4), drawn_places(plate, 3, 5)
    influence = fe.shell_influence(shell.undeformed, gauges, face="bottom")
    series = [[levy(plate, tuple(t), tuple(g), 8000)[1] for g in gauges] for t in touched]
    off = influence.strain(touched) + 0.5 * np.array(series)
    assert is_stated(off, influence.mesh_error(touched))


@pytest.mark.slow
def test_the_shell_of_a_long_plate_bends_as_the_linear_plate_does():
    plate, touch = long_plate(3.0), fe.Touch(129.0, 37.0, 1e-5)
    at = np.array([(149.0, 60.0), (129.0, 100.0), (114.0, 20.0)])
    shell, linear = fe.solve(plate, [touch]), fe.deflect(plate, [touch])
    truth = linear.strain(at)
    off = np.abs(shell.strain(at) - truth).max()
    assert off < 1e-3 * np.abs(truth).max()  # measured 2e-4
    assert off < 3 * shell.mesh_error(at).strain.max()
    assert shell.deflection(at) == pytest.approx(linear.deflection(at), rel=1e-3)


def test_elements_are_large_where_nothing_of_a_touch_is_left():
    plate, touch = long_plate(40.0), fe.Touch(1720.0, 37.0, 1.0)
    x = fe.touch_mesh(plate, [touch]).nodes[0]
    sizes, middles = np.diff(x), 0.5 * (x[1:] + x[:-1])
    near = np.abs(middles - 1720.0) < 150.0
    far = (np.abs(middles - 1720.0) > 800.0) & (np.minimum(middles, 4000.0 - middles) > 800.0)
    assert sizes[near].max() <= 100.0 / 6.0
    assert sizes[far].min() > 30.0


def test_a_mesh_of_runs_comes_back_from_its_arrays():
    plate = long_plate(3.0)
    influence = fe.influence(plate, [(30.0, 20.0)], face="bottom", length=6.0)
    assert influence.mesh.runs[0]
    back = fe.Influence.from_arrays(influence.arrays())
    assert back.mesh == influence.mesh
    assert (back.face, back.length) == ("bottom", 6.0)
    np.testing.assert_array_equal(back.strain([(40.0, 40.0)]), influence.strain([(40.0, 40.0)]))


def test_runs_that_do_not_add_up_are_refused():
    with pytest.raises(ValueError, match=r"^runs of a mesh along x must be 2 of at least 6"):
        fe.Mesh((100.0, 80.0), (20, 16), ((50.0,), ()), ((12, 6), ()))


@pytest.mark.slow
def test_strain_beside_a_point_force_is_not_a_number_and_under_a_disc_it_is():
    plate = fe.Plate((120.0, 90.0), **PVC)
    at = [(50.0, 40.0), (50.0, 40.9), (50.0, 56.0)]
    for state in (
        fe.deflect(plate, [fe.Touch(50.0, 40.0, 1.0)]),
        fe.solve(plate, [fe.Touch(50.0, 40.0, 1.0)], mesh=fe.grid(plate, 40)),
    ):
        assert np.isnan(state.strain(at)).all(axis=1).tolist() == [True, True, False]
        assert state.near_touch(at).tolist() == [True, True, False]
    assert np.isfinite(fe.deflect(plate, [fe.Touch(50.0, 40.0, 1.0, 6.0)]).strain(at)).all()


@pytest.mark.parametrize("ratio", [0.05, 0.2, 3.0])
def test_thick_plates_are_refused_by_every_theory(ratio):
    plate = fe.Plate((100.0, 80.0), ratio * 80.0, 3000.0, 0.3)
    touch = fe.Touch(30.0, 40.0, 1.0)
    for door in (
        lambda: fe.deflect(plate, [touch]),
        lambda: fe.influence(plate, [(5.0, 5.0)]),
        lambda: fe.displacement_influence(plate, [(5.0, 5.0)]),
        lambda: fe.modes(plate, 3),
        lambda: fe.solve(plate, [touch]),
        lambda: fe.reduced_plate(plate),
        lambda: fe.modal_plate(plate),
    ):
        with pytest.raises(ValueError, match=r"^plate thickness must stay below 0.05 of the span"):
            door()


def test_the_linear_range_says_what_shear_adds():
    # Bricks (C3D20R, 12 mm on 144) give 10 % under a touch on a clamped square of h/a = 0.083.
    said = fe.linear_range(fe.Plate((144.0, 144.0), 6.0, 3000.0, 0.3), 1.0)
    assert 4 * said.shear == pytest.approx(0.1, rel=0.2)
    assert "shear, left out, adds about 2." in said.sentence


def test_a_force_beyond_the_material_is_not_called_stable():
    plate = fe.Plate((254.0, 200.0), strain_limit=0.017, **PVC)
    mesh, place = fe.grid(plate, 16), (100.0, 90.0)
    beyond = fe.solve(plate, [fe.Touch(*place, 1e9)], mesh=mesh).stability
    assert beyond.verdict is fe.Verdict.OVERSTRAINED
    assert beyond.demand > 100
    finger = fe.solve(plate, [fe.Touch(*place, 3.0)], mesh=mesh).stability
    assert finger.verdict is fe.Verdict.STABLE
    assert 0 < finger.demand < 0.5
    assert fe.linear_range(plate, 1e9).demand > 100
    assert "times its limit" in fe.linear_range(plate, 1e9).sentence


def test_equivalent_strain_is_that_of_a_bar_pulled_to_the_same_stress_of_von_mises():
    strain = np.array([(2e-3, -0.3 * 2e-3, 0.0), (0.0, 0.0, 1e-3), (1e-3, 1e-3, 0.0)])
    # A pulled bar; pure shear, √3 G 2 exy / E; a drum, E e / (1 - ν) both ways.
    truth = [2e-3, np.sqrt(3) * 1e-3 / 1.3, 1e-3 / 0.7]
    assert equivalent(strain, 0.3) == pytest.approx(truth)


def test_a_strain_limit_must_be_positive():
    with pytest.raises(ValueError, match=r"^strain limit of a plate must be positive"):
        fe.Plate((100.0, 80.0), strain_limit=0.0, **PVC)

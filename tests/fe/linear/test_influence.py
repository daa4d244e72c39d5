"""Influence: one solve a gauge knows what a touch anywhere does to it."""

import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fe

PLATE = fe.Plate((150.0, 100.0), 2.0, 3000.0, 0.38)
MESH = fe.Mesh(PLATE.size, (30, 18))
# On a node, off the nodes, in an element of a corner, on an edge.
GAUGES = np.array([[75.0, 50.0], [41.3, 22.9], [1.0, 98.5], [0.0, 61.0], [127.7, 100.0]])
SOLVER = fe.Linear(PLATE, MESH)
INFLUENCE = fe.influence(PLATE, GAUGES, MESH)

places = st.tuples(st.floats(0, 150), st.floats(0, 100))


@given(st.lists(st.tuples(places, st.floats(-5, 5)), max_size=3))
@settings(max_examples=40)
def test_influence_gives_the_strain_of_the_deflected_plate(touches):
    xy = np.array([place for place, _ in touches]).reshape(-1, 2)
    force = np.array([f for _, f in touches])
    state = SOLVER.deflect([fe.Touch(x, y, f) for (x, y), f in touches])
    direct = replace(state, touches=()).strain(GAUGES)
    found = np.einsum("k,kmc->mc", force, INFLUENCE.strain(xy))
    np.testing.assert_allclose(
        found, direct, atol=1e-10 * np.abs(INFLUENCE.adjoint.values).max() * 5
    )


@pytest.mark.slow
def test_meshes_for_gauges_and_for_touches_give_one_strain():
    influence, at = fe.influence(PLATE, GAUGES), [[33.3, 47.1]]
    state = fe.deflect(PLATE, [fe.Touch(*at[0], 1.0)])
    assert influence.mesh.counts != state.mesh.counts
    strain, found = state.strain(GAUGES), influence.strain(at)[0]
    # Measured 1.7e-4, in the corner; elsewhere 1e-5. What both state of themselves covers it.
    assert np.abs(found - strain).max() < 3e-4 * np.abs(strain).max()
    stated = influence.mesh_error(at)[0].max() + state.mesh_error(GAUGES).strain.max()
    assert np.abs(found - strain).max() < 3 * stated


@given(places)
@settings(max_examples=60)
def test_gradient_is_the_derivative_of_the_strain(place):
    step = 1e-4
    xy = np.clip([place], step, np.array(PLATE.size) - step)
    gradient = INFLUENCE.gradient(xy)
    scale = np.abs(INFLUENCE.adjoint.values).max() / min(MESH.units)
    for axis in (0, 1):
        shift = step * np.eye(2)[axis]
        difference = (INFLUENCE.strain(xy + shift) - INFLUENCE.strain(xy - shift)) / (2 * step)
        np.testing.assert_allclose(gradient[..., axis], difference, atol=1e-4 * scale)


def test_shapes_are_touch_gauge_component_axis():
    xy = np.array([[10.0, 20.0], [30.0, 40.0], [50.0, 60.0], [149.0, 1.0]])
    assert INFLUENCE.strain(xy).shape == (4, 5, 3)
    assert INFLUENCE.gradient(xy).shape == (4, 5, 3, 2)
    assert INFLUENCE.strain(np.empty((0, 2))).shape == (0, 5, 3)


def test_a_touch_on_the_edge_strains_nothing():
    assert not INFLUENCE.strain([[0.0, 30.0], [75.0, 100.0]]).any()


def test_a_touch_near_an_edge_follows_the_half_plane():
    # Under a load P at distance d from a straight clamped edge w = P/8πD (r² ln(r/r') + 2 x d),
    # r to the load and r' to its image, so that the edge moment opposite the load is P/π.
    plate = fe.Plate((150.0, 100.0), 1.0, 3000.0, 0.3)
    strain = fe.influence(plate, [[75.0, 0.0]]).strain([[75.0, 6.0]])[0, 0]
    assert strain[1] == pytest.approx(
        0.5 * plate.thickness / (np.pi * plate.rigidity), rel=0.015
    )  # 1.1 % less: other edges


def test_progress_counts_the_strains():
    calls = []
    fe.influence(PLATE, np.tile(GAUGES, (4, 1)), MESH, progress=lambda *call: calls.append(call))
    assert calls == [(24, 60), (48, 60), (60, 60)]


def test_a_touch_outside_the_plate_is_refused():
    with pytest.raises(ValueError, match=r"^touch 1 must lie on the plate"):
        INFLUENCE.strain([[1.0, 1.0], [151.0, 1.0]])


def test_influence_survives_a_file():
    file = io.BytesIO()
    np.savez(file, **INFLUENCE.arrays())
    file.seek(0)
    again = fe.Influence.from_arrays(np.load(file))
    assert again.plate == PLATE
    assert again.mesh == MESH
    np.testing.assert_array_equal(again.gauges, GAUGES)
    np.testing.assert_array_equal(again.strain([[3.0, 4.0]]), INFLUENCE.strain([[3.0, 4.0]]))


def test_a_damaged_file_is_refused():
    arrays = INFLUENCE.arrays()
    with pytest.raises(ValueError, match=r"^stored arrays must hold 'gauges', got plate, edges"):
        fe.Influence.from_arrays({k: v for k, v in arrays.items() if k != "gauges"})
    with pytest.raises(ValueError, match=r"^nodal values must have shape \(62, 38, 15\), got"):
        fe.Influence.from_arrays(arrays | {"values": arrays["values"][:-1]})
    with pytest.raises(ValueError, match=r"^stored array 'counts' must have shape"):
        fe.Influence.from_arrays(arrays | {"counts": np.arange(3)})


def test_its_arrays_cannot_be_changed():
    for array in (INFLUENCE.gauges, INFLUENCE.adjoint.values):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0

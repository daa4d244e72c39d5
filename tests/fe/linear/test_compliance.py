"""The yield under a touch near edges and corners, where elements are least exact."""

import numpy as np
import pytest

import fe

SIZE = (100.0, 80.0)


def test_near_a_clamped_edge_it_is_that_of_the_half_plane():
    # P d² / 4πD; the plate itself is two hundred times as large.
    plate = fe.Plate(SIZE, 1.0, 3000.0, 0.3)
    found = fe.compliance(fe.Linear(plate, fe.default_mesh(plate)), [[50.0, 0.4]])[0]
    assert found == pytest.approx(0.4**2 / (4 * np.pi * plate.rigidity), rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("edges", [fe.Clamped(), fe.Edges(fe.Clamped(), *(fe.Free(),) * 3)])
@pytest.mark.parametrize("place", [[1.0, 0.8], [99.0, 40.0], [50.0, 79.3], [100.0, 80.0]])
def test_one_per_cent_from_an_edge_or_corner_a_finer_mesh_says_the_same(edges, place):
    plate = fe.Plate(SIZE, 1.0, 3000.0, 0.3, edges)
    coarse, fine = (
        fe.compliance(fe.Linear(plate, fe.Mesh(SIZE, counts)), [place])[0]
        for counts in ((50, 40), (100, 80))
    )
    assert coarse == pytest.approx(fine, rel=2e-3, abs=1e-12)


def test_windows_do_not_reach_over_a_border_of_a_patch():
    patch = fe.Patch((40.0, 60.0), (30.0, 80.0), 2.0, 3000.0)
    plate = fe.Plate(SIZE, 1.0, 3000.0, 0.3, patches=(patch,))
    solver = fe.Linear(plate, fe.grid(plate, 50))
    finer = fe.Linear(plate, fe.grid(plate, 100))
    for place in ([41.0, 50.0], [39.0, 50.0], [70.0, 31.0]):
        found = fe.compliance(solver, [place])
        np.testing.assert_allclose(found, fe.compliance(finer, [place]), rtol=1e-3)


def test_a_place_off_the_plate_is_refused():
    plate = fe.Plate(SIZE, 1.0, 3000.0, 0.3)
    with pytest.raises(ValueError, match=r"^touch 0 must lie on the plate"):
        fe.compliance(fe.Linear(plate, fe.Mesh(SIZE, (10, 8))), [[101.0, 3.0]])


def test_a_thick_plate_is_refused():
    plate = fe.Plate(SIZE, 5.0, 3000.0, 0.3)
    with pytest.raises(ValueError, match=r"plate thickness must stay below 0\.05 of the span"):
        fe.compliance(fe.Linear(plate, fe.grid(plate, 20)), [[50.0, 40.0]])
